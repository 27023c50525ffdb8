# SPDX-License-Identifier: Apache-2.0
"""What a fault of a log is, and what was found of one."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
import math
from typing import Any, ClassVar

import numpy as np

from leo_diffmodel.bags.recording import Episode
from leo_diffmodel.faults.settings import LIMITS
from leo_sim.description.joint import sliding

Array = np.ndarray
Patch = Mapping[str, Any]
"""Keys of one joint in a topic map, or of the map itself, that undo a fault."""
COLUMNS = {'angle': 'q', 'speed': 'dq', 'input': 'inputs'}
"""Of an episode, by channel."""


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
    looks_like: ClassVar[str]
    """A sentence each; the last says what it does to an answer if it is not seen."""
    confused_with: ClassVar[str]
    costs: ClassVar[str]
    todo: ClassVar[str] = ''  # what to do where no map undoes it
    whole_log: ClassVar[bool] = False  # it is one for all joints

    def spoil(self, e: Episode, j: int, a: int, value: float) -> Episode:
        """The episode as a log with this fault has it.

        Args:
            e: as it was.
            j: the joint.
            a: its actuator, where it has one.
            value: size of the fault.
        """
        name, column = COLUMNS[self.channel], a if self.channel == 'input' else j
        values = getattr(e, name).copy()
        values[:, column] = self.logged(e.t, values[:, column], value)
        return replace(e, **{name: values})

    def logged(self, t: Array, x: Array, value: float) -> Array:
        """What a log has of its channel x (T,) at times t (T,) [s]."""
        raise NotImplementedError

    def patch(self, value: float, names: Sequence[str] = ()) -> Patch:
        """What undoes it in a topic map; empty where no map can.

        Args:
            value: size of the fault.
            names: joints whose columns it is about.
        """
        return {self.key: value} if self.key else {}


class Factor(Fault):
    """A channel logged as a multiple of what happened; `key` of a topic map has the inverse."""

    def logged(self, t: Array, x: Array, value: float) -> Array:
        """The multiple."""
        return value * x

    def patch(self, value: float, names: Sequence[str] = ()) -> Patch:
        """The inverse of the factor."""
        return {self.key: 1 / value}


@dataclass(frozen=True)
class Found:
    """A fault that was found."""

    fault: Fault
    joint: str  # its joint; '' where it is of the whole log
    value: float  # estimate, in the fault's unit
    sd: float  # standard deviation of the estimate
    what: str  # a sentence without a full stop
    error: bool  # whether the interval excludes every harmless reading
    evidence: str  # kinematics, balance or sensor
    worst: float = 0.0
    """By how much the estimate could be off if all that the model leaves over were of one kind; 0
    where no model was asked."""
    where: tuple[tuple[float, float], ...] = ()
    """Stretches [s since the first state]; empty for all of it."""
    otherwise: tuple[str, ...] = ()  # other readings of the same contradiction, in words
    names: tuple[str, ...] = ()  # whose columns it is about, where it is of several joints
    gained: float = math.inf
    """Standard errors by which a log with it predicts blocks of time that were left out better
    than all that is ordinary does; infinite where that was not asked."""
    bag: str = field(default='', compare=False)  # path of the log
    slides: bool = False  # whether its joint does

    @property
    def ci95(self) -> tuple[float, float]:
        """Of the value."""
        return self.value - LIMITS.sigmas * self.sd, self.value + LIMITS.sigmas * self.sd

    @property
    def patch(self) -> Patch:
        """What mends it in a topic map."""
        return self.fault.patch(self.value, self.names)

    @property
    def cuts(self) -> bool:
        """Whether leaving out its stretches mends it."""
        return bool(self.where) and not self.patch

    @property
    def can_be_mended(self) -> bool:
        """Whether it is sure what it is and how it is undone."""
        return self.error and (self.cuts or bool(self.patch)) and not self.otherwise

    @property
    def mending(self) -> str:
        """How it is undone, in words."""
        return 'left out' if self.cuts else self.line

    @property
    def line(self) -> str:
        """The line of a topic map that mends it, '' where none does."""
        inside = ', '.join(f'{k}: {_figure(v)}' for k, v in self.patch.items())
        if not inside:
            return ''
        return f'joints: {{{self.joint}: {{{inside}}}}}' if self.joint else inside

    def to_json(self) -> dict:
        """An entry of `log_faults`."""
        channel = f'{self.fault.channel} of {self.joint}' if self.joint else self.fault.channel
        return {
            'name': self.fault.name,
            'channel': channel,
            'value': self.value,
            'unit': sliding(self.fault.unit) if self.slides else self.fault.unit,
            'ci95': list(self.ci95),
            'sure': self.error,
            'mend': self.line or self.fault.todo,
            'what': self.what,
            'evidence': self.evidence,
            'otherwise': list(self.otherwise),
            'where': [list(w) for w in self.where],
            'bag': self.bag,
        }


def _figure(value: Any) -> str:
    if isinstance(value, Mapping):
        return f'{{{", ".join(f"{k}: {v}" for k, v in value.items())}}}'
    if isinstance(value, bool):
        return str(value).lower()
    return f'{value:.6g}' if isinstance(value, float) else str(value)
