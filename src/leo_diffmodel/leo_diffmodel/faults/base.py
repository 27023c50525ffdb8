# SPDX-License-Identifier: Apache-2.0
"""What a fault of a log is."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
import math
from typing import Any, ClassVar

import numpy as np

from leo_diffmodel.bags.recording import Episode

Array = np.ndarray
Patch = Mapping[str, Any]
"""Keys of one joint in a topic map, or of the map itself, that undo a fault."""
COLUMNS = {'angle': 'q', 'speed': 'dq', 'input': 'inputs'}  # of an episode, by channel


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

    def inject(self, e: Episode, j: int, a: int, value: float) -> Episode:
        """The episode as a log has it that has this fault, of size `value`, at joint j.

        Its actuator is a, where it has one.
        """
        name, column = COLUMNS[self.channel], a if self.channel == 'input' else j
        values = getattr(e, name).copy()
        values[:, column] = self.logged(e.t, values[:, column], value)
        return replace(e, **{name: values})

    def logged(self, t: Array, x: Array, value: float) -> Array:
        """What a log has of its channel x (T,) at times t (T,) [s]."""
        raise NotImplementedError

    def patch(self, value: float, names: Sequence[str] = ()) -> Patch:
        """What undoes it in a topic map, by the names of its joints; empty where no map can."""
        return {self.key: value} if self.key else {}


class Factor(Fault):
    """A channel logged as a multiple of what happened; `key` of a topic map has the inverse."""

    def logged(self, t: Array, x: Array, value: float) -> Array:
        return value * x

    def patch(self, value: float, names: Sequence[str] = ()) -> Patch:
        return {self.key: 1 / value}
