# SPDX-License-Identifier: Apache-2.0
"""Serialized messages that wait at a subscription, each with the GID of its publisher.

rclpy's own take gives all that rmw knows of a message (rmw/types.h, Jazzy) but the GID, so rcl's
function is called here, found through the library that rclpy has loaded.
"""

from collections.abc import Iterator
from contextlib import contextmanager
import ctypes as c
from typing import NamedTuple

from rclpy.impl.implementation_singleton import rclpy_implementation
from rclpy.subscription import Subscription

_OK, _NOTHING = 0, 401
_UNKNOWN = 2**64 - 1


class Taken(NamedTuple):
    """A message as it came; times and number are 0 where unknown."""

    data: bytes  # CDR
    published_ns: int
    received_ns: int
    number: int  # how many its publisher has sent
    publisher: bytes  # its GID


class _Gid(c.Structure):
    _fields_ = [('implementation', c.c_char_p), ('data', c.c_uint8 * 16)]


class _Info(c.Structure):
    _fields_ = [
        ('published', c.c_int64),
        ('received', c.c_int64),
        ('number', c.c_uint64),
        ('received_number', c.c_uint64),
        ('publisher', _Gid),
        ('within_process', c.c_bool),
    ]


class _Allocator(c.Structure):
    _fields_ = [
        (name, c.c_void_p)
        for name in ('allocate', 'deallocate', 'reallocate', 'zero_allocate', 'state')
    ]


class _Bytes(c.Structure):
    _fields_ = [
        ('buffer', c.c_void_p),
        ('length', c.c_size_t),
        ('capacity', c.c_size_t),
        ('allocator', _Allocator),
    ]


_rcl = c.CDLL(rclpy_implementation.__file__)
_rcl.rcutils_get_default_allocator.restype = _Allocator
_rcl.rcl_take_serialized_message.argtypes = [c.c_void_p] * 4


def taken(subscription: Subscription) -> Iterator[Taken]:
    """The messages that wait, as they came; RCLError where one cannot be taken."""
    with subscription.handle, _buffer() as data:
        info = _Info()
        while _take(subscription, data, info):
            yield Taken(
                c.string_at(data.buffer, data.length),
                info.published,
                info.received,
                0 if info.number == _UNKNOWN else info.number,
                bytes(info.publisher.data),
            )


def _take(subscription: Subscription, data: _Bytes, info: _Info) -> bool:
    result = _rcl.rcl_take_serialized_message(
        subscription.handle.pointer, c.addressof(data), c.addressof(info), None
    )
    if result not in (_OK, _NOTHING):
        _rcl.rcutils_reset_error()
        raise rclpy_implementation.RCLError(f'no message can be taken: rcl says {result}')
    return bool(result == _OK)


@contextmanager
def _buffer() -> Iterator[_Bytes]:
    """Room for a message, which rcl enlarges as needed."""
    data = _Bytes(allocator=_rcl.rcutils_get_default_allocator())
    try:
        yield data
    finally:
        _rcl.rcutils_uint8_array_fini(c.byref(data))
