# SPDX-License-Identifier: Apache-2.0
"""A fault that was found in a log."""

from collections.abc import Mapping
from dataclasses import dataclass
import math
from typing import Any

from leo_diffmodel.faults.catalogue import Fault, FAULTS, Patch
from leo_diffmodel.faults.settings import LIMITS
from leo_diffmodel.outside.finding import Finding
from leo_sim.description.joint import sliding


@dataclass(frozen=True, kw_only=True)
class Found(Finding):
    """A fault of the catalogue, its size, and its evidence; an error excludes what is harmless."""

    joint: str = ''  # '' where it is of the whole log
    value: float  # estimate, in the fault's unit
    sd: float = 0.0  # standard deviation of the estimate
    evidence: str  # kinematics, balance or sensor
    worst: float = 0.0
    """By how much the estimate could be off if all that the model leaves over were of one kind; 0
    where no model was asked."""
    otherwise: tuple[str, ...] = ()  # other readings of the same contradiction, in words
    names: tuple[str, ...] = ()  # whose columns it is about, where it is of several joints
    gained: float = math.inf
    """Standard errors by which a log with it predicts blocks of time that were left out better
    than all that is ordinary does; infinite where that was not asked."""
    slides: bool = False  # whether its joint does

    @property
    def fault(self) -> Fault:
        return FAULTS[self.code]

    @property
    def ci95(self) -> tuple[float, float]:
        return self.value - LIMITS.sigmas * self.sd, self.value + LIMITS.sigmas * self.sd

    @property
    def patch(self) -> Patch:
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
    def in_words(self) -> str:
        """What it is, and the other readings."""
        return '; or '.join([self.what, *self.otherwise])

    @property
    def mending(self) -> str:
        return 'left out' if self.cuts else self.line

    @property
    def line(self) -> str:
        """The line of a topic map that mends it, '' where none does."""
        inside = ', '.join(f'{k}: {_figure(v)}' for k, v in self.patch.items())
        if not inside:
            return ''
        return f'joints: {{{self.joint}: {{{inside}}}}}' if self.joint else inside

    def to_json(self) -> dict:
        fault = self.fault
        return {
            'name': self.code,
            'channel': f'{fault.channel} of {self.joint}' if self.joint else fault.channel,
            'value': self.value,
            'unit': sliding(fault.unit) if self.slides else fault.unit,
            'ci95': list(self.ci95),
            'sure': self.error,
            'mend': self.line or fault.todo,
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
