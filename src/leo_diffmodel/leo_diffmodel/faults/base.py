# SPDX-License-Identifier: Apache-2.0
"""What a fault of a log is."""

from collections.abc import Mapping, Sequence
import math
from typing import Any, ClassVar

Patch = Mapping[str, Any]
"""Keys of one joint in a topic map, or of the map itself, that undo a fault."""


class Fault:
    """Something that can be wrong with a log: a class of `catalogue`."""

    name: ClassVar[str]  # stable, for programs
    channel: ClassVar[str]  # angle, speed, input or time
    unit: ClassVar[str] = ''  # of its value; '' for a factor
    key: ClassVar[str] = ''
    """Of a topic map, whose value is its size, that undoes it; '' where there is none."""
    turn: ClassVar[float] = math.inf
    """Values that differ by it are the same; infinite where none are."""
    law: ClassVar[str]  # what is logged, of what happened
    harmless: ClassVar[tuple[float, float]] = (0.0, 0.0)
    """Sizes that a good log may have, lowest and highest; outside it is an error."""
    harmless_words: ClassVar[str] = ''  # the same where it is not a size in the fault's unit
    looks_like: ClassVar[str]  # a sentence
    confused_with: ClassVar[str]  # a sentence
    costs: ClassVar[str]  # what it does to an answer if it is not seen, a sentence
    todo: ClassVar[str] = ''  # what to do where no map undoes it
    whole_log: ClassVar[bool] = False  # it is one for all joints

    def patch(self, value: float, names: Sequence[str] = ()) -> Patch:
        """What undoes it in a topic map, by the names of its joints; empty where no map can."""
        return {self.key: value} if self.key else {}


class Factor(Fault):
    """A channel logged as a multiple of what happened; `key` of a topic map has the inverse."""

    def patch(self, value: float, names: Sequence[str] = ()) -> Patch:
        return {self.key: 1 / value}
