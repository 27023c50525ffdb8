# SPDX-License-Identifier: Apache-2.0
"""An answer in words, part by part: all in one sentence, or a headline and lines."""

from dataclasses import dataclass, replace
from typing import NamedTuple


class Thing(NamedTuple):
    """One of those that a sentence lists: an effect, a fault or a stretch of time."""

    name: str
    words: str = ''

    def __str__(self) -> str:
        return f'{self.name} {self.words}'.strip()


@dataclass(frozen=True)
class Told:
    about: str  # what is said of the things, up to its colon
    things: tuple[Thing, ...] = ()  # what it is said of
    change: str = ''  # of the held-out error
    notes: tuple[str, ...] = ()  # what keeps it from being sure, and what was done to the data
    more: tuple[str, ...] = ()  # further sentences

    def __str__(self) -> str:
        listed = '; '.join(filter(None, [*map(str, self.things), self.change]))
        notes = f' ({"; ".join(self.notes)})' if self.notes else ''
        first = f'{": ".join(filter(None, [self.about, listed]))}{notes}.'
        return ' '.join([first, *self.more])

    def lines(self, space: int) -> list[str]:
        """All of it where that takes no more characters; else a headline, and a line on each.

        A headline that is too long itself has the names of the things alone.
        """
        short = replace(self, notes=())
        if len(str(self)) <= space:
            return [str(self)]
        if len(str(short)) <= space:
            return [str(short), *self.notes]
        head, each = replace(short, change='', more=()), list[str]()
        if len(str(head)) > space:
            each = [f'{thing}.' for thing in self.things if thing.words]
            head = replace(head, things=tuple(Thing(thing.name) for thing in self.things))
        change = [f'{self.change}.'] if self.change else []
        return [str(head), *each, *change, *self.more, *self.notes]
