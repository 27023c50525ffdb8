# SPDX-License-Identifier: Apache-2.0
"""REP-2011 type hashes (RIHS01) of messages, service halves and whole services."""

from functools import cache

from rosbags.interfaces import Nodetype
from rosbags.interfaces.typing import FieldDesc
from rosbags.typesys import get_typestore, Stores
from rosbags.typesys.store import Typestore

from leo_msgs_py.wire.definitions import fields, typestore


@cache
def type_hash(name: str) -> str:
    """'RIHS01_' and 64 hex digits of a type 'pkg/msg/Name', 'pkg/srv/Name[_Request]'.

    Raises:
        UserError: the type is not known.
    """
    fields(name)
    return _hashing_store().hash_rihs01(name)


@cache
def _hashing_store() -> Typestore:
    """The type store with `char` as `uint8`, which is what rosidl hashes it as."""
    store = get_typestore(Stores.EMPTY)
    store.fielddefs = {
        name: (constants, [(field, _char_as_uint8(desc)) for field, desc in entries])
        for name, (constants, entries) in typestore().fielddefs.items()
    }
    return store


def _char_as_uint8(desc: FieldDesc) -> FieldDesc:
    if desc[0] == Nodetype.BASE:
        return (Nodetype.BASE, ('uint8', 0)) if desc[1][0] == 'char' else desc
    if desc[0] == Nodetype.NAME:
        return desc
    element, count = desc[1]
    return (desc[0], (_char_as_uint8(element), count))  # type: ignore[return-value]
