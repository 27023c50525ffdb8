# SPDX-License-Identifier: Apache-2.0
"""Names that are looked up; a message about an unknown one has the nearest that is known."""

from collections.abc import Iterable, Mapping
from difflib import get_close_matches
from typing import TypeVar

from leo_msgs_py.errors import UserError

Value = TypeVar('Value')


def look_up(name: str, table: Mapping[str, Value], missing: str) -> Value:
    """What a table has by a name; UserError, `missing` with the name and the nearest: nothing."""
    if name not in table:
        raise UserError(f'{missing} {name!r}{nearest(name, table)}')
    return table[name]


def nearest(name: str, known: Iterable[str]) -> str:
    """'; did you mean ...?' or, when nothing is close, '; known: ...'."""
    names = sorted(known)
    close = get_close_matches(name, names, n=1, cutoff=0.4)
    return f'; did you mean {close[0]}?' if close else f'; known: {", ".join(names)}'
