# SPDX-License-Identifier: Apache-2.0
"""Message and service classes that behave like ROS ones, and their CDR codec."""

from collections.abc import Callable, Iterable
from functools import cache
from typing import Any, cast, ClassVar

import numpy as np
from rosbags.interfaces import Nodetype
from rosbags.interfaces.typing import FieldDesc
from rosbags.typesys.base import normalize_fieldname

from leo_msgs_py.errors import UserError
from leo_msgs_py.wire.definitions import fields, SERVICES, typestore

Convert = Callable[[Any], Any]
# kinds of numpy types a field's type takes: booleans, floats; whole numbers for the others
_KINDS = {'b': 'b', 'f': 'biuf'}
PLACEHOLDER = 'structure_needs_at_least_one_member'


class Message:
    """A ROS message: keyword constructor, defaults, plain attributes.

    Numeric array fields are numpy arrays of the right type and take any sequence; string and
    message sequences are lists. A name that is no field raises AttributeError.
    """

    __msgtype__: ClassVar[str]
    _defaults: ClassVar[dict[str, Callable[[], Any]]]
    _convert: ClassVar[dict[str, Convert | None]]

    def __init__(self, *decoded: Any, **values: Any) -> None:
        """Set fields by keyword; positional values are the decoder's, complete and typed."""
        if decoded:
            self.__dict__.update(zip(self._defaults, decoded, strict=True))
            return
        for name, default in self._defaults.items():
            self.__dict__[name] = default()
        for name, value in values.items():
            setattr(self, name, value)

    def __setattr__(self, name: str, value: Any) -> None:
        try:
            convert = self._convert[name]
        except KeyError:
            raise AttributeError(f'{self.__msgtype__} has no field {name!r}') from None
        self.__dict__[name] = convert(value) if convert else value

    @classmethod
    def get_fields_and_field_types(cls) -> dict[str, str]:
        """Field names and their ROS types, as the generated ROS classes give them."""
        return {name: _ros_type(desc) for name, desc in fields(cls.__msgtype__)}

    def __eq__(self, other: object) -> bool:
        if type(self) is not type(other):
            return NotImplemented
        theirs = other.__dict__
        return all(np.array_equal(v, theirs[k]) for k, v in self.__dict__.items())

    __hash__ = None  # type: ignore[assignment]

    def __repr__(self) -> str:
        shown = (f'{k}={v!r}' for k, v in self.__dict__.items() if k != PLACEHOLDER)
        return f'{type(self).__name__}({", ".join(shown)})'


class Service:
    """A ROS service type: the classes of its two halves."""

    __srvtype__: ClassVar[str]
    Request: ClassVar[type[Message]]
    Response: ClassVar[type[Message]]


@cache
def message_class(name: str) -> type[Message]:
    """Class of the message or service half 'pkg/msg/Name' (one and the same at each call).

    Raises:
        UserError: the type is not known.
    """
    name = full_name(name)
    members = {normalize_fieldname(field): desc for field, desc in fields(name)}
    body: dict[str, Any] = {
        '__msgtype__': name,
        '__doc__': f'{name}: {", ".join(members)}.',
        '_defaults': {field: _default(desc) for field, desc in members.items()},
        '_convert': {field: _converter(desc) for field, desc in members.items()},
    }
    body.update({key: value for key, _, value in typestore().fielddefs[name][0]})
    cls = type(name.rpartition('/')[2], (Message,), body)
    typestore().types[name] = cast(Any, cls)
    return cls


@cache
def service_class(name: str) -> type[Service]:
    """Class of the service 'pkg/srv/Name' with `Request` and `Response`.

    Raises:
        UserError: the service is not known.
    """
    name = full_name(name, 'srv')
    if name not in SERVICES:
        raise UserError(f'unknown service type {name!r}; known are {", ".join(sorted(SERVICES))}')
    body = {
        '__srvtype__': name,
        'Request': message_class(f'{name}_Request'),
        'Response': message_class(f'{name}_Response'),
    }
    return type(name.rpartition('/')[2], (Service,), body)


def full_name(name: str, kind: str = 'msg') -> str:
    """'pkg/Name' spelt out as 'pkg/msg/Name'."""
    package, slash, rest = name.partition('/')
    return f'{package}/{kind}/{rest}' if slash and '/' not in rest else name


def type_name(cls: type) -> str:
    """'pkg/msg/Name' of a message class, 'pkg/srv/Name' of a service class (ROS's or ours)."""
    for attribute in ('__msgtype__', '__srvtype__'):
        if hasattr(cls, attribute):
            return cast(str, getattr(cls, attribute))
    package, kind = cls.__module__.split('.')[:2]
    return f'{package}/{kind}/{cls.__name__}'


def serialize(message: Any) -> bytes:
    """CDR bytes of a message, 4-byte encapsulation header first, unpadded."""
    if isinstance(message, Message):
        return bytes(typestore().serialize_cdr(message, message.__msgtype__))
    from rclpy.serialization import serialize_message

    return cast(bytes, serialize_message(message))


def deserialize(data: bytes, name: str) -> Message:
    """Message of the type `name` from CDR bytes (padded or not); its arrays are writable.

    Raises:
        rosbags.serde.SerdeError: the bytes are no such message.
    """
    message_class(name)
    return cast(Message, typestore().deserialize_cdr(memoryview(bytearray(data)), name))


def _default(desc: FieldDesc) -> Callable[[], Any]:
    """What makes the default value of a field: zero, empty, default message."""
    if desc[0] == Nodetype.NAME:
        return message_class(desc[1])
    if desc[0] == Nodetype.BASE:
        return {'string': str, 'bool': bool, 'float32': float, 'float64': float}.get(
            desc[1][0], int
        )
    element, count = desc[1]
    length = count if desc[0] == Nodetype.ARRAY else 0
    if _dtype(element) is not None:
        return lambda: np.zeros(length, _dtype(element))
    make = _default(element)
    return lambda: [make() for _ in range(length)]


def _converter(desc: FieldDesc) -> Convert | None:
    """What brings an assigned value into the form the codec needs (None: nothing to do)."""
    if desc[0] == Nodetype.BASE:
        return _octet if desc[1][0] == 'byte' else None
    if desc[0] == Nodetype.NAME:
        return None
    element, count = desc[1]
    length = count if desc[0] == Nodetype.ARRAY else None
    dtype = _dtype(element)
    if dtype is None:
        return _list
    return lambda value: _array(value, dtype, length)


def _octet(value: int | bytes) -> int:
    return value[0] if isinstance(value, bytes) else int(value)


def _list(value: Iterable[Any]) -> list[Any]:
    if isinstance(value, str):
        raise TypeError(f'expected a list of values, got the string {value!r}')
    return list(value)


def _array(value: Any, dtype: np.dtype[Any], length: int | None) -> np.ndarray:
    if isinstance(value, (bytes, bytearray, memoryview)):
        value = np.frombuffer(value, np.uint8)
    given = np.asarray(value)
    if given.ndim != 1 or length not in (None, given.size):
        raise ValueError(f'expected {length or "a list of"} numbers, got shape {given.shape}')
    if given.size and given.dtype.kind not in _KINDS.get(dtype.kind, 'iu'):
        raise ValueError(f'expected {dtype} values, got {given.dtype} {value!r}')
    return np.ascontiguousarray(given, dtype)


def _dtype(desc: FieldDesc) -> np.dtype[Any] | None:
    """Numpy type of a numeric field as the codec reads it, None for strings and messages."""
    if desc[0] != Nodetype.BASE or desc[1][0] == 'string':
        return None
    special = {'bool': np.bool_, 'byte': np.uint8, 'char': np.uint8}
    return np.dtype(special.get(desc[1][0], desc[1][0]))


def _ros_type(desc: FieldDesc) -> str:
    """A field's type in ROS spelling: 'double', 'sequence<string>', 'std_msgs/Header'."""
    if desc[0] == Nodetype.BASE:
        name, bound = desc[1]
        ros = {'float64': 'double', 'float32': 'float', 'bool': 'boolean', 'byte': 'octet'}
        return f'string<{bound}>' if bound else ros.get(name, name)
    if desc[0] == Nodetype.NAME:
        return desc[1].replace('/msg/', '/')
    element, count = desc[1]
    if desc[0] == Nodetype.ARRAY:
        return f'{_ros_type(element)}[{count}]'
    return f'sequence<{_ros_type(element)}{f", {count}" if count else ""}>'
