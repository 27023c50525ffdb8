# SPDX-License-Identifier: Apache-2.0
"""How strong an effect must be to be found and named: logistic curves over lines of results.

Of the lines of single effects (`effect`) and of weak and strong ones in runs of 10 to 40 s
(`strength`) on the robots that take turns. The slopes in the logarithm of the size and of the
seconds are shared by all effects: with so few lines of each, its own would follow single cases.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from scipy.optimize import minimize
from scipy.special import expit, logit

from leo_lab.blind.suite import robot_of

Array = np.ndarray
KINDS, FOUND = ('effect', 'strength'), ('named', 'partly', 'ambiguous', 'unknown')
EXACT = {'ftol': 1e-14, 'gtol': 1e-9, 'maxiter': 2000}
"""So near the optimum that no processor's rounding shows in two digits."""
USUAL = 20.0
"""Seconds of data, where a line does not say."""
RIDGE = 0.05
"""Of squared slopes and of what effects differ by: holds those that are always or never right."""


class Curves(NamedTuple):
    """Chances of all effects: logit = level of the effect + slopes . (log size, log seconds / 20).

    Attributes:
        names: of the effects.
        levels: of each, shape (E,).
        slopes: shared, shape (2,).
    """

    names: tuple[str, ...]
    levels: Array
    slopes: Array

    def chance(self, name: str, size: Array, seconds: float) -> Array:
        """Of an effect with so many noise floors in so many seconds of data."""
        return np.asarray(expit(self._at(name, seconds) + self.slopes[0] * np.log(size)))

    def size_for(self, name: str, chance: float, seconds: float) -> float:
        """Noise floors that an effect must have for such a chance."""
        return float(np.exp((logit(chance) - self._at(name, seconds)) / self.slopes[0]))

    def _at(self, name: str, seconds: float) -> float:
        level = self.levels[self.names.index(name)]
        return float(level + self.slopes[1] * np.log(seconds / USUAL))


def usable(lines: Sequence[dict]) -> list[dict]:
    """Lines of single effects on the robots that take turns."""
    return [line for line in lines if line['kind'] in KINDS and robot_of(line) is None]


def outcome(line: dict, what: str) -> bool:
    """Whether something is said to be missing ('seen'), or the right thing ('right')."""
    return line['verdict'] in FOUND if what == 'seen' else bool(line['right'])


def fitted(lines: Sequence[dict], what: str) -> Curves:
    """The curves of most likelihood; neither slope is negative."""
    names = tuple(sorted({line['effects'][0]['name'] for line in lines}))
    of = np.array([names.index(line['effects'][0]['name']) for line in lines])
    size = np.log([line['effects'][0]['size'] for line in lines])
    time = np.log([line.get('data_seconds', USUAL) / USUAL for line in lines])
    hit = np.array([outcome(line, what) for line in lines])

    def cost(x: Array) -> float:
        z = x[0] + x[1:-2][of] + x[-2] * size + x[-1] * time
        return float(np.logaddexp(0.0, np.where(hit, -z, z)).sum()) + RIDGE * float(x[1:] @ x[1:])

    first = np.r_[np.zeros(1 + len(names)), 1.0, 0.5]
    bounds = [(None, None)] * (1 + len(names)) + [(1e-3, None), (0.0, None)]
    best = minimize(cost, first, bounds=bounds, options=EXACT).x
    return Curves(names, best[0] + best[1:-2], best[-2:])
