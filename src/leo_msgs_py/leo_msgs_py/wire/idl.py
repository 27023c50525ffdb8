# SPDX-License-Identifier: Apache-2.0
"""DDS types of ROS messages whose samples stay bytes.

Cyclone needs a type's structure to check samples and to announce it; encoding and decoding are
left to `wire.types`, which is faster and lets recorders pass bytes through.
"""

from __future__ import annotations

from functools import cache
from typing import Any, cast

from cyclonedds.idl import IdlStruct, make_idl_struct, types
from rosbags.interfaces import Nodetype
from rosbags.interfaces.typing import FieldDesc

from leo_msgs_py.wire.definitions import fields

_BASE: dict[str, Any] = {
    'bool': bool,
    'byte': types.uint8,
    'char': types.uint8,
    'float32': types.float32,
    'float64': types.float64,
    **{f'int{n}': getattr(types, f'int{n}') for n in (8, 16, 32, 64)},
    **{f'uint{n}': getattr(types, f'uint{n}') for n in (8, 16, 32, 64)},
}
_SERVICE_HEADER = {'guid': types.uint64, 'seq': types.int64}


class Sample:
    """Serialized bytes in the place of a decoded sample.

    Attributes:
        data: CDR bytes, encapsulation header first; padded to a multiple of 4 when received.
        sample_info: Cyclone's sample info, set on reception.
    """

    __slots__ = ('data', 'sample_info')
    __idl__: Any

    def __init__(self, data: bytes) -> None:
        self.data = data
        self.sample_info: Any = None

    def serialize(self, use_version_2: bool | None = None) -> bytes:
        """The bytes as they are (ROS uses XCDR version 1 only)."""
        return self.data

    @classmethod
    def deserialize(cls, data: bytes) -> Sample:
        """The bytes as they are."""
        return cls(data)

    @classmethod
    def deserialize_key(cls, data: bytes) -> Sample:
        """The bytes of a sample without data, as sent when a writer goes away."""
        return cls(data)


@cache
def sample_class(name: str) -> Any:
    """Sample class of a message 'pkg/msg/Name', or of a service half with its header."""
    header = _SERVICE_HEADER if '/srv/' in name else {}
    return type('Sample', (Sample,), {'__slots__': (), '__idl__': _struct(name, header).__idl__})


def _struct(name: str, header: dict[str, Any]) -> type[IdlStruct]:
    package, kind, leaf = name.split('/')
    members = {field: _member(desc) for field, desc in fields(name)}
    return make_idl_struct(leaf, f'{package}.{kind}.dds_.{leaf}_', {**header, **members})


@cache
def _nested(name: str) -> type[IdlStruct]:
    return _struct(name, {})


def _member(desc: FieldDesc) -> Any:
    """IDL type of a field."""
    if desc[0] == Nodetype.BASE:
        base, bound = desc[1]
        if base == 'string':
            return types.bounded_str[bound] if bound else str
        return _BASE[base]
    if desc[0] == Nodetype.NAME:
        return _nested(desc[1])
    element, count = desc[1]
    inner = _member(cast(FieldDesc, element))
    if desc[0] == Nodetype.ARRAY:
        return types.array[inner, count]
    return types.sequence[inner, count] if count else types.sequence[inner]
