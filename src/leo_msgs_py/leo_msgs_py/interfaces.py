# SPDX-License-Identifier: Apache-2.0
"""Message and service classes by the names that the graph and the command line give them."""

from importlib import import_module
from importlib.util import find_spec
from pathlib import Path
import re
from typing import Any

from leo_msgs_py.errors import UserError

_NAME = re.compile(r'([a-z]\w*)/(?:(msg|srv|action)/)?([A-Z]\w*)', re.ASCII)
_CONVERTED: dict[str, Any] = {'double': float, 'float': float, 'octet': lambda v: bytes([v])}
_SEQUENCE = re.compile(r'sequence<([\w/]+)(?:, \d+)?>|([\w/]+)\[\d+\]')


def load(name: str, kind: str = 'msg') -> Any:
    """Class of 'pkg/msg/Name' or of 'pkg/Name', which is of `kind`; UserError where it is none."""
    found = _NAME.fullmatch(name)
    package, folder, leaf = found.groups() if found else ('', '', '')
    try:
        if not found or not _has(package, folder or kind):
            raise ImportError
        return getattr(import_module(f'{package}.{folder or kind}'), leaf)
    except (ImportError, AttributeError, ValueError) as error:
        raise UserError(
            f'no type {name!r} is installed; write for example std_msgs/msg/String'
        ) from error


def _has(package: str, folder: str) -> bool:
    """Whether a package holds interfaces; others may do anything when they are imported."""
    spec = find_spec(package)
    places = spec.submodule_search_locations if spec else None
    return any(Path(place, folder).is_dir() for place in places or ())


def to_plain(value: Any) -> Any:
    if hasattr(value, 'get_fields_and_field_types'):
        return {n: to_plain(getattr(value, n)) for n in value.get_fields_and_field_types()}
    if isinstance(value, bytes):
        return list(value) if len(value) != 1 else value[0]
    if hasattr(value, 'tolist'):
        return value.tolist()
    return [to_plain(item) for item in value] if isinstance(value, (list, tuple)) else value


def fill(message: Any, data: dict[str, Any]) -> Any:
    """Set a message's fields from a dictionary and return it; UserError where one does not fit."""
    message._check_fields = True  # else a setter takes anything, and 1 is sent as False
    of, kinds = type(message).__name__, message.get_fields_and_field_types()
    for name, value in data.items():
        if name not in kinds:
            there = ', '.join(kinds) or 'none'
            raise UserError(f'{of} has no field {name!r}; it has: {there}')
        try:
            setattr(message, name, _convert(getattr(message, name), value, kinds[name]))
        except (TypeError, ValueError, AssertionError) as error:
            raise UserError(f'{of}.{name} ({kinds[name]}) cannot be {value!r}') from error
    return message


def _convert(current: Any, value: Any, kind: str) -> Any:
    if hasattr(current, 'get_fields_and_field_types'):
        return fill(current, _mapping(value))
    found = _SEQUENCE.fullmatch(kind)
    element = (found[1] or found[2]) if found else ''
    if '/' in element:
        cls = load(element)
        return [fill(cls(), _mapping(item)) for item in value]
    convert = _CONVERTED.get(element or kind)
    if convert is None:
        return value
    return [convert(item) for item in value] if element else convert(value)


def _mapping(value: Any) -> dict[str, Any]:
    if not isinstance(value, dict):
        raise UserError(f'{value!r} should be a mapping {{field: value, ...}}')
    return value
