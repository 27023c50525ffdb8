# SPDX-License-Identifier: Apache-2.0
"""The start states that fit best with the parameters fixed, each window on its own.

Gauss-Newton with the sensitivity of an earlier point (a chord), which costs one rollout a step; it
is found again in those windows alone where a step saves less than half of what it promises, as
where dry friction bends what a start does.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from leo_diffmodel.explain.problem import shooting
from leo_diffmodel.explain.problem.hypothesis import Hypothesis
from leo_diffmodel.explain.problem.problem import Problem

Array = np.ndarray
ROUNDS = 6
KEPT = 0.5
"""Of what the linearisation promises of a step; less, and it is found again where it was left."""
SHORTER = 0.3
"""Times the step that led nowhere."""
SETTLED_SHARE = 1e-3
"""Of the mean loss: what the next step of a window, and of all, must promise to be taken."""


def settle(
    problem: Problem,
    hypothesis: Hypothesis,
    theta: Array,
    starts: Sequence[Array],
    by_start: Array | None = None,
) -> tuple[Array, Array]:
    """Settle from each of several start states, and keep the best in each window.

    Args:
        problem: the windows.
        hypothesis: what acts.
        theta: its values, shape (P,).
        starts: where to begin, each (W, 2J).
        by_start: sensitivity of the whitened residual to them, found nearby, (W, N, 2J).

    Returns:
        Start states (W, 2J), and the loss of each window there [nats], (W,).
    """
    count = problem.windows.count
    tiled = np.tile(np.arange(count), len(starts))
    fixed = problem.fixed(hypothesis, theta).take(tiled)
    at = _Settling(fixed, np.concatenate(starts), None if by_start is None else by_start[tiled])
    for _ in range(ROUNDS):
        if not at.going.any():
            break
        at.step()
    best = at.loss.reshape(-1, count).argmin(axis=0) * count + np.arange(count)
    return at.start[best], at.loss[best]


class _Settling:
    """Windows on the way to the start states that fit them best.

    Attributes:
        start: start states, shape (W, 2J).
        loss: of each window there [nats], shape (W,).
        going: windows that are not settled yet, shape (W,).
    """

    def __init__(self, fixed: Problem, start: Array, by_start: Array | None):
        self._fixed, self.start, self._asked = fixed, start, fixed.linearisation is None
        if fixed.linearisation or by_start is None:
            linear = _linearised(fixed, start)
            self._residual, self._by_start = linear.residual, linear.by_start
        else:
            self._residual, self._by_start = residual_at(fixed, start), by_start
        self.loss = shooting.huber(self._residual)
        self._fresh = np.full(len(start), by_start is None)
        self._scale = np.ones(len(start))
        self._moved, self._promised = np.zeros_like(start), np.zeros(len(start))
        self._plan(np.arange(len(start)))

    @property
    def going(self) -> Array:
        """Windows whose next step promises something, (W,)."""
        train = self._fixed.train
        least = SETTLED_SHARE * float(self.loss[train].mean())
        worth = self._promised[train].sum() > SETTLED_SHARE * self.loss[train].sum()
        return (self._promised > least) & worth

    def step(self) -> None:
        """Move the windows that are going, each as far as it gains."""
        index = np.flatnonzero(self.going)
        there = self.start[index] + self._moved[index]
        residual = residual_at(self._fixed.take(index), there)
        gained = self.loss[index] - shooting.huber(residual)
        bent, better = gained < KEPT * self._promised[index], gained > 0
        self.start[index[better]] = there[better]
        self._residual[index[better]] = residual[better]
        self.loss[index] -= np.maximum(gained, 0.0)
        stale = bent & (better | ~self._fresh[index]) & self._asked
        self._scale[index] *= np.where(bent & ~stale, SHORTER, 1.0)
        self._fresh[index[better]] = False
        self._refresh(index[stale])
        self._plan(index)

    def _refresh(self, index: Array) -> None:
        """Find the sensitivity of some windows again."""
        if index.size:
            part = self._fixed.take(index)
            self._by_start[index] = _linearised(part, self.start[index]).by_start
            self._fresh[index] = True

    def _plan(self, index: Array) -> None:
        """The next step of some windows, and what it promises to save."""
        residual, by_start = self._residual[index], self._by_start[index]
        self._moved[index] = moved = self._scale[index, None] * _steps(residual, by_start)
        ahead = residual + (by_start @ moved[..., None])[..., 0]
        self._promised[index] = self.loss[index] - shooting.huber(ahead)


def _linearised(fixed: Problem, start: Array) -> shooting.Linear:
    return shooting.linearise(fixed.base, fixed.windows, fixed.weight, Hypothesis(), np.zeros(0),
                              start, fixed.by_start)  # fmt: skip


def residual_at(fixed: Problem, start: Array) -> Array:
    """Whitened residual of the problem as it stands from some start states, (W, N)."""
    predicted = shooting.predict(fixed.base, fixed.windows, start)
    return shooting.whiten(fixed.windows, predicted, fixed.weight)


def _steps(residual: Array, by_start: Array) -> Array:
    """The Gauss-Newton step of each start state, (W, 2J)."""
    linear = shooting.Linear(residual, by_start, np.zeros((*residual.shape, 0)))
    weight = shooting.robust_weight(shooting.eliminate(linear)[0])
    return -shooting.eliminate(linear, weight)[2]
