# SPDX-License-Identifier: Apache-2.0
"""The column map of `leo import`: which columns are what, in which unit and sign.

`leo import --help` shows one. Besides: `records: [a, b]` and `fields: {angle: 'Y[*][0]'}` of
arrays have an episode for each place or [*]; `time: {period: 0.001}`; a name alone is
short for {column: name}. Computed columns may use those before. Numbers that a log has besides its
rows, as a head does, are columns with one value in all rows. A value is
sign * scale * (column in SI) + offset, the offset in SI.
"""

from collections.abc import Mapping, Sequence
from typing import Annotated, Literal

import numpy as np
from pydantic import BeforeValidator, Field, model_validator

from leo_msgs_py import units
from leo_msgs_py.errors import UserError
from leo_msgs_py.names import nearest
from leo_sim.common.yaml_file import Fixed

from .expression import evaluate, names_in
from .log_format import canonical_index, Column, LogFormat, without_infinite
from .unit_names import canonical, fits

QUANTITIES: dict[str, tuple[str, ...]] = {
    'position': ('rad', 'm'),
    'velocity': ('rad/s', 'm/s'),
    'effort': ('N m', 'N'),
    'voltage': ('V',),
    'supply_voltage': ('V',),
    'current': ('A',),
    'temperature': ('degC',),
    'enabled': ('1',),
    'time': ('s',),
}
"""What a column can be, and the units a bag has it in."""


def _name(value: object) -> object:
    return str(value) if isinstance(value, int) and not isinstance(value, bool) else value


Name = Annotated[str, BeforeValidator(_name)]


class ColumnSpec(Fixed):
    column: Name | None = None
    expression: str | None = None
    unit: str | None = None
    sign: Literal[1, -1] = 1
    scale: float = Field(default=1.0, allow_inf_nan=False)
    offset: float = Field(default=0.0, allow_inf_nan=False)

    @model_validator(mode='after')
    def _one_source(self) -> 'ColumnSpec':
        if (self.column is None) == (self.expression is None):
            raise ValueError('give either column or expression')
        return self

    @property
    def source(self) -> str:
        return str(self.column or self.expression)

    @property
    def says_unit(self) -> bool:
        """Whether the map says what its numbers are, and does not leave it to be SI."""
        return self.column is None or self.unit is not None or self.scale != 1.0

    def values(
        self, columns: Mapping[str, Column], quantity: str, log: str, unit: str | None = None
    ) -> Column:
        """The values in SI, shape (T,), NaN where there is none; `log` opens the error line.

        `unit` is the one that a bag has it in, where the quantity is none of `QUANTITIES`.
        """
        targets = QUANTITIES[quantity] if unit is None else (unit,)
        where = f'{log}, {self.source}'
        factor = self.sign * self.scale * unit_factor(self.unit, quantity, where, targets)
        with np.errstate(over='ignore', invalid='ignore'):
            return without_infinite(factor * self._raw(columns, quantity, log) + self.offset)

    def _raw(self, columns: Mapping[str, Column], quantity: str, log: str) -> Column:
        if self.expression is not None:
            return evaluate(self.expression, columns)
        name = str(self.column)
        name = name if name in columns else canonical_index(name)
        if name not in columns:
            raise UserError(
                f'{log} has no column {name!r} for {quantity}; it has {", ".join(columns)}'
            )
        return columns[name]


class TimeSpec(Fixed):
    column: Name | None = None
    period: float | None = Field(default=None, gt=0.0)
    unit: str = 's'

    @model_validator(mode='after')
    def _one_source(self) -> 'TimeSpec':
        if (self.column is None) == (self.period is None):
            raise ValueError('give either column or period')
        return self


def _short(value: object) -> object:
    return {'column': _name(value)} if isinstance(_name(value), str) else value


Spec = Annotated[ColumnSpec, BeforeValidator(_short)]
Time = Annotated[TimeSpec, BeforeValidator(_short)]
Interface = Literal[
    'voltage', 'effort', 'position', 'enabled', 'supply_voltage', 'current', 'temperature'
]


class JointColumns(Fixed):
    position: Spec
    velocity: Spec | None = None
    effort: Spec | None = None


class ColumnMap(LogFormat):
    robot: str | None = None
    columns: dict[str, str] = Field(default_factory=dict)
    time: Time
    joints: dict[str, JointColumns] = Field(min_length=1)
    inputs: dict[str, dict[Interface, Spec]] = Field(default_factory=dict)
    constants: dict[str, Spec] = Field(default_factory=dict)

    def named(self) -> frozenset[str]:
        joints = [spec for of in self.joints.values() for _, spec in of if spec]
        inputs = [spec for of in self.inputs.values() for spec in of.values()]
        specs = [*joints, *inputs, *self.constants.values(), self.time]
        sums = [*self.columns.values(), *(getattr(s, 'expression', None) or '' for s in specs)]
        columns = {canonical_index(spec.column) for spec in specs if spec.column}
        return frozenset(columns.union(*map(names_in, sums)))

    @model_validator(mode='after')
    def _inputs_drive_joints(self) -> 'ColumnMap':
        for joint, interfaces in self.inputs.items():
            if joint not in self.joints:
                raise ValueError(f'inputs name {joint!r}{nearest(joint, self.joints)}')
            if not {'voltage', 'effort', 'position'} & set(interfaces):
                raise ValueError(f'the input of {joint!r} needs voltage, effort or position')
        return self

    @model_validator(mode='after')
    def _constants_of_a_robot(self) -> 'ColumnMap':
        if self.constants and self.robot is None:
            raise ValueError('constants need the robot that has them; add robot: NAME')
        return self


def unit_factor(unit: str | None, quantity: str, where: str, targets: Sequence[str]) -> float:
    """Return what brings a column in `unit` to the first fitting target, 1 where none is given."""
    if unit is None or unit in targets:
        return 1.0
    if unit == '?':
        raise UserError(f'{where}: fill in the unit of {quantity} in the column map')
    if unit == '%' and quantity in ('position', 'velocity'):
        raise UserError(
            f'{where}: per cent of a range is no {quantity}; give scale: rad for 1 %, and no unit'
        )
    unit = canonical(unit)
    try:
        target = next((target for target in targets if fits(unit, (target,))), None)
    except UserError as error:
        raise UserError(f'{where}, {quantity}: {error}') from None
    if target is None:
        raise UserError(
            f'{where}: {unit!r} is no unit of {quantity}; give it in {" or ".join(targets)}'
        )
    return units.conversion(unit, target, quantity)
