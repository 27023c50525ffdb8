# SPDX-License-Identifier: Apache-2.0
"""Service payloads of rmw_cyclonedds: a 16-byte header in front of the fields, in the body.

The header {uint64 guid; int64 seq} follows the 4-byte encapsulation; being a multiple of 8 long
it leaves the alignment of the fields as it is. A server echoes it, a client knows its own guid.
"""

import struct
from typing import NamedTuple

_HEADER = struct.Struct('<Qq')
_ENCAPSULATION = 4
_BODY = _ENCAPSULATION + _HEADER.size


class Header(NamedTuple):
    """Who asked (64-bit client id) and which of its requests it was."""

    guid: int
    seq: int


def join(header: Header, payload: bytes) -> bytes:
    """Serialized half with the header put in; `payload` starts with its encapsulation."""
    return payload[:_ENCAPSULATION] + _HEADER.pack(*header) + payload[_ENCAPSULATION:]


def split(data: bytes) -> tuple[Header, bytes]:
    """Header and the serialized half without it."""
    header = Header(*_HEADER.unpack_from(data, _ENCAPSULATION))
    return header, data[:_ENCAPSULATION] + data[_BODY:]
