# SPDX-License-Identifier: Apache-2.0
"""The column map of `leo import`: which columns are what, in which unit and sign.

    robot: servo_pendulum                  # optional, for the record and the next command
    records: entries                       # JSON: where the list of rows is
    fields: {angle: 'Y[*][0]'}             # JSON, MATLAB: arrays; [*] = one episode each
    columns: {duty: load / 885}            # computed, may use those before
    time: {column: time, unit: ms}         # or {period: 0.001}
    joints:
      pivot:
        position: {column: angle, unit: deg, sign: -1, offset: 3.14159}
        velocity: speed                    # short for {column: speed}; may be left out
    inputs:                                # left out for a passive log
      pivot:
        voltage: {expression: duty * supply}
        enabled: torque_on                 # 0 = motor free

A value is sign * scale * (column in SI) + offset, the offset in SI.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Annotated, Literal

from pydantic import BaseModel, BeforeValidator, ConfigDict, Field, model_validator

from leo_msgs_py.errors import UserError

from ..yaml_config import nearest
from .expression import Column, evaluate

UNITS: dict[str, dict[str, float]] = {
    'angle or length': {
        'rad': 1.0, 'deg': 0.017453292519943295, 'rev': 6.283185307179586, 'm': 1.0, 'cm': 0.01,
        'mm': 0.001,
    },
    'rate': {
        'rad/s': 1.0, 'deg/s': 0.017453292519943295, 'rpm': 0.10471975511965977,
        'rev/s': 6.283185307179586, 'm/s': 1.0, 'mm/s': 0.001,
    },
    'torque or force': {'N m': 1.0, 'Nm': 1.0, 'mN m': 0.001, 'mNm': 0.001, 'N': 1.0},
    'voltage': {'V': 1.0, 'mV': 0.001},
    'current': {'A': 1.0, 'mA': 0.001},
    'time': {'s': 1.0, 'ms': 1e-3, 'us': 1e-6, 'ns': 1e-9, 'min': 60.0},
    'temperature': {'degC': 1.0},
    'switch': {'': 1.0},
}
QUANTITIES = {
    'position': 'angle or length', 'velocity': 'rate', 'effort': 'torque or force',
    'voltage': 'voltage', 'supply_voltage': 'voltage', 'current': 'current',
    'temperature': 'temperature', 'enabled': 'switch', 'time': 'time',
}


class ColumnSpec(BaseModel):
    """One value over time: a column or an expression, brought to SI."""

    model_config = ConfigDict(extra='forbid', frozen=True)

    column: str | None = None
    expression: str | None = None
    unit: str | None = None
    sign: Literal[1, -1] = 1
    scale: float = Field(default=1.0, allow_inf_nan=False)
    offset: float = Field(default=0.0, allow_inf_nan=False)

    @model_validator(mode='after')
    def _one_source(self) -> ColumnSpec:
        if (self.column is None) == (self.expression is None):
            raise ValueError('give either column or expression')
        return self

    def values(self, columns: Mapping[str, Column], quantity: str, log: str) -> Column:
        """Return the values in SI, shape (T,).

        Args:
            columns: of the log, each of shape (T,).
            quantity: key of `QUANTITIES`.
            log: opens the error line.

        Raises:
            UserError: no such column, or a unit of something else.
        """
        factor = unit_factor(self.unit, quantity, log)
        return self.sign * self.scale * factor * self._raw(columns, quantity, log) + self.offset

    def _raw(self, columns: Mapping[str, Column], quantity: str, log: str) -> Column:
        if self.expression is not None:
            return evaluate(self.expression, columns)
        name = str(self.column)
        if name not in columns:
            raise UserError(
                f'{log} has no column {name!r} for {quantity}; it has {", ".join(columns)}'
            )
        return columns[name]


class TimeSpec(BaseModel):
    """Time as a column, or as a constant sampling period [s]."""

    model_config = ConfigDict(extra='forbid', frozen=True)

    column: str | None = None
    period: float | None = Field(default=None, gt=0.0)
    unit: str = 's'

    @model_validator(mode='after')
    def _one_source(self) -> TimeSpec:
        if (self.column is None) == (self.period is None):
            raise ValueError('give either column or period')
        return self


def _short(value: object) -> object:
    return {'column': value} if isinstance(value, str) else value


Spec = Annotated[ColumnSpec, BeforeValidator(_short)]
Time = Annotated[TimeSpec, BeforeValidator(_short)]
Interface = Literal[
    'voltage', 'effort', 'enabled', 'supply_voltage', 'current', 'temperature'
]


class JointColumns(BaseModel):
    """Columns of one joint."""

    model_config = ConfigDict(extra='forbid', frozen=True)

    position: Spec
    velocity: Spec | None = None
    effort: Spec | None = None


class ColumnMap(BaseModel):
    """A whole column map (module docstring shows the file)."""

    model_config = ConfigDict(extra='forbid', frozen=True)

    robot: str | None = None
    format: Literal['csv', 'json', 'mat'] | None = None
    delimiter: str = ','
    header: list[str] | None = None
    records: str | None = None
    fields: dict[str, str | list[str]] = {}
    columns: dict[str, str] = {}
    time: Time
    joints: dict[str, JointColumns] = Field(min_length=1)
    inputs: dict[str, dict[Interface, Spec]] = {}

    @model_validator(mode='after')
    def _inputs_drive_joints(self) -> ColumnMap:
        for joint, interfaces in self.inputs.items():
            if joint not in self.joints:
                raise ValueError(f'inputs name {joint!r}{nearest(joint, list(self.joints))}')
            if not {'voltage', 'effort'} & set(interfaces):
                raise ValueError(f'the input of {joint!r} needs voltage or effort')
        return self


def unit_factor(unit: str | None, quantity: str, where: str) -> float:
    """Return the factor to SI of a unit, 1 where none is given.

    Raises:
        UserError: the unit is not one of this quantity.
    """
    known = UNITS[QUANTITIES[quantity]]
    if unit is None:
        return 1.0
    if unit not in known:
        raise UserError(
            f'{where}: {unit!r} is no unit of {quantity}; use {", ".join(filter(None, known))}'
        )
    return known[unit]
