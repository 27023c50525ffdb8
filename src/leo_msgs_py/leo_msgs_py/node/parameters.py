# SPDX-License-Identifier: Apache-2.0
"""A node's parameters: declared with a default, typed by it, set by the command line."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np

from leo_msgs_py import messages as m
from leo_msgs_py.errors import UserError

# rcl_interfaces/ParameterType in order, with the ParameterValue field of each
_FIELDS = (
    '',
    'bool_value',
    'integer_value',
    'double_value',
    'string_value',
    'byte_array_value',
    'bool_array_value',
    'integer_array_value',
    'double_array_value',
    'string_array_value',
)
NAMES = (
    'not set', 'bool', 'integer', 'double', 'string',
    'byte array', 'bool array', 'integer array', 'double array', 'string array',
)  # fmt: skip
_SCALARS: tuple[type, ...] = (bool, int, float, str)

Check = Callable[[list['Parameter']], Any]


@dataclass(frozen=True)
class Parameter:
    """A parameter and its value."""

    name: str
    value: Any

    @property
    def type(self) -> int:
        """Its rcl_interfaces/ParameterType."""
        return parameter_type(self.value)


class Parameters:
    """The declared parameters of one node.

    Args:
        overrides: values from the command line and parameter files.
        announce: called with a parameter that services may show, after it changed.
    """

    def __init__(
        self, overrides: dict[str, Any], announce: Callable[[Parameter, bool], None]
    ) -> None:
        self._overrides = overrides
        self._announce = announce
        self._values: dict[str, Any] = {}
        self._descriptors: dict[str, Any] = {}
        self._private: set[str] = set()
        self._checks: list[Check] = []

    def declare(self, name: str, default: Any, descriptor: Any, private: bool) -> Parameter:
        """Declare a parameter; the command line's value wins over the default.

        Raises:
            UserError: a value of another type than the default's.
            ValueError: declared before.
        """
        if name in self._values:
            raise ValueError(f'parameter {name!r} is declared already')
        value = self._overrides.get(name, default)
        if default is not None:
            value = cast(name, value, parameter_type(default))
        self._values[name] = value
        self._descriptors[name] = descriptor or m.ParameterDescriptor()
        if private:
            self._private.add(name)
        else:
            self._announce(Parameter(name, value), True)
        return Parameter(name, value)

    def get(self, name: str) -> Parameter:
        """A declared parameter, private or not; KeyError for any other."""
        return Parameter(name, self._values[name])

    def public(self) -> list[str]:
        """Names of the parameters that services may show, sorted."""
        return sorted(self._values.keys() - self._private)

    def is_public(self, name: str) -> bool:
        """Whether services may show it."""
        return name in self._values and name not in self._private

    def describe(self, name: str) -> Any:
        """rcl_interfaces/ParameterDescriptor of a declared parameter."""
        descriptor = self._descriptors[name]
        descriptor.name = name
        descriptor.type = parameter_type(self._values[name])
        return descriptor

    def add_check(self, check: Check) -> None:
        """Have `check` called with parameters to be set; its result says whether to."""
        self._checks.append(check)

    def set(self, parameters: list[Parameter]) -> Any:
        """Set all or none; the rcl_interfaces/SetParametersResult says why not."""
        try:
            wanted = [self._checked(parameter) for parameter in parameters]
        except UserError as error:
            return m.SetParametersResult(successful=False, reason=str(error))
        for check in self._checks:
            result = check(wanted)
            if not result.successful:
                return result
        for parameter in wanted:
            self._values[parameter.name] = parameter.value
            self._announce(parameter, False)
        return m.SetParametersResult(successful=True)

    def _checked(self, parameter: Parameter) -> Parameter:
        name = parameter.name
        if not self.is_public(name):
            raise UserError(f'parameter {name!r} has not been declared')
        if self._descriptors[name].read_only:
            raise UserError(f'parameter {name!r} cannot be set while the node runs')
        kind = parameter_type(self._values[name])
        return Parameter(name, cast(name, parameter.value, kind)) if kind else parameter


def parameter_type(value: Any) -> int:
    """rcl_interfaces/ParameterType of a Python value.

    Raises:
        UserError: a value ROS parameters cannot hold.
    """
    if value is None:
        return 0
    if isinstance(value, bytes):
        return 5
    for number, scalar in enumerate(_SCALARS, 1):
        if isinstance(value, scalar):
            return number
    if isinstance(value, (list, tuple, np.ndarray)):
        return _array_type(value.tolist() if isinstance(value, np.ndarray) else list(value))
    raise UserError(f'{value!r} is no ROS parameter value')


def _array_type(values: list[Any]) -> int:
    for offset, scalar in enumerate(_SCALARS):
        if all(isinstance(value, scalar) for value in values):
            return 6 + offset
    if all(isinstance(value, (int, float)) for value in values):
        return 8
    raise UserError(f'{values!r} is no ROS parameter value: mixed types')


def cast(name: str, value: Any, kind: int) -> Any:
    """The value as the declared type: whole numbers become floats, nothing else changes.

    Raises:
        UserError: another type.
    """
    found = parameter_type(value)
    if found == kind:
        return value
    if (found, kind) == (2, 3):
        return float(value)
    if kind > 5 and found > 5 and (not len(value) or (found, kind) == (7, 8)):
        return [float(v) for v in value] if kind == 8 else list(value)
    raise UserError(f'parameter {name!r} is a {NAMES[kind]}, not {value!r}')


def to_value_message(value: Any) -> Any:
    """As rcl_interfaces/ParameterValue."""
    kind = parameter_type(value)
    message = m.ParameterValue(type=kind)
    if kind:
        setattr(message, _FIELDS[kind], list(value) if kind > 4 else value)
    return message


def from_value_message(message: Any) -> Any:
    """Python value of a rcl_interfaces/ParameterValue."""
    if not message.type:
        return None
    value = getattr(message, _FIELDS[message.type])
    if message.type == 5:
        return bytes(np.asarray(value, np.uint8))
    return np.asarray(value).tolist() if message.type in (6, 7, 8) else value
