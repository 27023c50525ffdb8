# SPDX-License-Identifier: Apache-2.0
"""One finding of a check: what is so, where in the bag, and what to do about it."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import asdict, dataclass

OK, WARNING, ERROR = 'ok', 'warning', 'error'
SHOWN = 3


@dataclass(frozen=True)
class Finding:
    """What one check found.

    Attributes:
        code: stable name of the finding, for programs.
        severity: ok; warning, which limits what can be learned; or error, which makes what is
            learned wrong.
        what: a sentence.
        where: stretches of the bag [s since its first state], empty for all of it.
        todo: what to do about it; empty where nothing is to be done.
        bag: path of the bag.
    """

    code: str
    severity: str
    what: str
    where: tuple[tuple[float, float], ...] = ()
    todo: str = ''
    bag: str = ''

    def to_json(self) -> dict:
        """Plain lists and strings."""
        return asdict(self) | {'where': [list(w) for w in self.where]}


def times(stretches: Sequence[tuple[float, float]]) -> str:
    """The first few stretches in words."""
    told = ', '.join(f'{begin:.2f}-{end:.2f} s' for begin, end in stretches[:SHOWN])
    more = len(stretches) - SHOWN
    return f'{told} and {more} more' if more > 0 else told
