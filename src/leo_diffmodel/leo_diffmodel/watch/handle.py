# SPDX-License-Identifier: Apache-2.0
"""A parameter of an effect on a slider: fine near what changes nothing, coarse far from it."""

from __future__ import annotations

from dataclasses import dataclass
from math import isfinite, pi

from leo_sim.effects import Parameter

POWER = 4
DIGITS = 4


@dataclass(frozen=True)
class Handle:
    """The plausible range of a parameter, and where on a slider each value lies.

    Positions go from -1 (the lowest value) over 0 (as near to no effect as there is) to 1 (the
    highest value); where no effect is an end of the range, that half is not there.

    Attributes:
        parameter: with the limits of `explain.problem.candidates`.
        low: lowest value.
        high: highest value.
    """

    parameter: Parameter
    low: float
    high: float

    @classmethod
    def of(cls, parameter: Parameter) -> Handle:
        """A handle of a parameter; an angle without limits turns once."""
        low = parameter.low if isfinite(parameter.low) else -pi
        high = parameter.high if isfinite(parameter.high) else pi
        return cls(parameter, low, high)

    @property
    def anchor(self) -> float:
        """The value at position 0."""
        return min(max(self.parameter.neutral, self.low), self.high)

    @property
    def ends(self) -> tuple[float, float]:
        """The lowest and the highest position."""
        return (-1.0 if self.low < self.anchor else 0.0, 1.0 if self.high > self.anchor else 0.0)

    def value(self, position: float) -> float:
        """The value at a position, rounded to what one can see."""
        span = self.high - self.anchor if position > 0 else self.anchor - self.low
        size = abs(position) ** POWER * span
        return self.inside(self.anchor + (size if position > 0 else -size))

    def position(self, value: float) -> float:
        """Where a value lies."""
        off = min(max(value, self.low), self.high) - self.anchor
        span = self.high - self.anchor if off > 0 else self.anchor - self.low
        size = (abs(off) / span) ** (1 / POWER) if span else 0.0
        return float(size if off > 0 else -size)

    def inside(self, value: float) -> float:
        """As `exact`, rounded to four digits before."""
        return self.exact(float(f'{value:.{DIGITS}g}'))

    def exact(self, value: float) -> float:
        """The value within the range that is nearest; whole where it has to be."""
        within = min(max(float(value), self.low), self.high)
        return float(max(1, round(within))) if self.parameter.whole else within
