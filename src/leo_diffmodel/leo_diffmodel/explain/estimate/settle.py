# SPDX-License-Identifier: Apache-2.0
"""The start states that fit best with the parameters fixed, each window on its own.

Levenberg-Marquardt on the 2J numbers of all windows at once. The sensitivity may be that of an
earlier point (a chord); it is found again where a step saves less than half of what it promises.
On the way windows are integrated as roughly as sensitivities are, plus what the fine step adds at
their begin; at the end they are predicted finely.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from math import inf

import numpy as np

from leo_diffmodel.compare.windows import Array
from leo_diffmodel.explain.problem import likelihood
from leo_diffmodel.explain.problem.hypothesis import Hypothesis
from leo_diffmodel.explain.problem.problem import Problem
from leo_diffmodel.explain.problem.shooting import Linear


@dataclass(frozen=True)
class Settled:
    """Windows at the start states that fit them best."""

    start: Array  # shape (W, 2J)
    loss: Array  # of each window [nats], shape (W,)
    residual: Array  # whitened, shape (W, N)
    by_start: Array  # sensitivity of the residual to the start, there or nearby, shape (W, N, 2J)

    def take(self, index: Array) -> 'Settled':
        return Settled(*(x[index] for x in vars(self).values()))


def settle(
    problem: Problem,
    hypothesis: Hypothesis,
    theta: Array,
    starts: Sequence[Array],
    by_start: Array | None = None,
    nats: float = inf,
) -> Settled:
    """Settle from each of several start states (W, 2J), and keep the best in each window.

    `theta` (P,) are the values of the hypothesis, `by_start` (W, N, 2J) is the sensitivity of the
    whitened residual to the start states, found nearby. They are settled where all windows
    together promise less than `nats`, and none more than the settings say.
    """
    count = problem.windows.count
    tiled = np.tile(np.arange(count), len(starts))
    fixed = problem.fixed(hypothesis, theta).take(tiled)
    by_start = by_start if by_start is None else by_start[tiled]
    enough = min(problem.numerics.start_nats, nats / count)
    at = _Settling(fixed, np.concatenate(starts), by_start).settled(enough)
    best = at.loss.reshape(-1, count).argmin(axis=0) * count + np.arange(count)
    return at.take(best)


class _Settling:
    def __init__(self, fixed: Problem, start: Array, by_start: Array | None):
        self._fixed, self._rough = fixed, fixed.roughly
        known = fixed.by_start if by_start is None else by_start
        if known is None:
            linear = _linearised(fixed, start)
            residual, known = linear.residual, linear.by_start
        else:
            residual = fixed.residual(start)
        self._first = Settled(start, self._lost(residual), residual, known)
        self._at = Settled(*(x.copy() for x in vars(self._first).values()))
        self._added: Array | None = None
        if self._rough is not fixed:
            self._added = residual - self._rough.residual(start)
        self._fresh = np.full(len(start), by_start is None or fixed.by_start is not None)

    def settled(self, enough: float) -> Settled:
        """Step until no window's next step promises `enough` [nats], or none gains."""
        going, numerics = np.arange(len(self._fresh)), self._fixed.numerics
        first = numerics.start_dampings[:1]
        for number in range(numerics.rounds):
            steps, promised = self._planned(going, numerics.start_dampings if number else first)
            worth = promised > enough
            going = going[worth]
            if not going.size:
                break
            going = going[self._step(going, steps[:, worth], promised[worth])]
        return self._at if self._added is None else self._checked()

    def _checked(self) -> Settled:
        first, at = self._first, self._at
        residual = self._fixed.residual(at.start)
        loss = self._lost(residual)
        better = loss < first.loss
        return Settled(
            np.where(better[:, None], at.start, first.start),
            np.where(better, loss, first.loss),
            np.where(better[:, None], residual, first.residual),
            at.by_start,
        )

    def _planned(self, index: Array, dampings: Sequence[float]) -> tuple[Array, Array]:
        """The next steps of some windows, (D, w, 2J), and what the first promises [nats]."""
        residual, by_start = self._at.residual[index], self._at.by_start[index]
        steps = _damped_steps(self._fixed, residual, by_start, dampings)
        ahead = residual + (by_start @ steps[0][..., None])[..., 0]
        return steps, self._at.loss[index] - self._lost(ahead)

    def _lost(self, residual: Array) -> Array:
        fixed = self._fixed
        channels = 2 * fixed.windows.q.shape[-1]
        return likelihood.loss(residual, channels, fixed.numerics, fixed.typical)

    def _step(self, index: Array, steps: Array, promised: Array) -> Array:
        """Move the windows by their best step; which of them may have another one, (w,)."""
        at, starts = self._at, self._at.start[index] + steps
        residuals = self._rough.take(index).residual(starts)
        if self._added is not None:
            residuals += self._added[index]
        losses = self._lost(residuals)
        best = losses.argmin(axis=0), np.arange(len(index))
        gained = at.loss[index] - losses[best]
        better = gained > 0
        moved = index[better]
        at.start[moved], at.residual[moved], at.loss[moved] = (
            x[best][better] for x in (starts, residuals, losses)
        )
        stale = (gained < self._fixed.numerics.kept * promised) & (better | ~self._fresh[index])
        stale &= self._fixed.by_start is None
        first, self._fresh[moved] = len(steps) == 1, False
        if stale.any():
            again = index[stale]
            at.by_start[again] = _linearised(self._rough.take(again), at.start[again]).by_start
            self._fresh[again] = True
        return better | stale | first


def _damped_steps(
    fixed: Problem, residual: Array, by_start: Array, dampings: Sequence[float]
) -> Array:
    """The Levenberg-Marquardt steps of each window's start state, (D, w, 2J)."""
    weight = likelihood.robust_weight(residual, by_start.shape[-1], fixed.numerics, fixed.typical)
    weighed = np.swapaxes(by_start * weight[..., None], -1, -2)
    matrix, slope = weighed @ by_start, weighed @ residual[..., None]
    size = np.sqrt(np.maximum(np.diagonal(matrix, axis1=-2, axis2=-1), 1e-30))
    scaled = matrix / (size[:, :, None] * size[:, None, :])
    damped = scaled + np.array(dampings)[:, None, None, None] * np.eye(size.shape[-1])
    return -np.linalg.solve(damped, slope / size[..., None])[..., 0] / size


def _linearised(fixed: Problem, start: Array) -> Linear:
    return fixed.linearised(Hypothesis(), np.zeros(0), start)
