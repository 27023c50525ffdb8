# SPDX-License-Identifier: Apache-2.0
"""Multiple shooting: every window has its own free start state, all share the parameters.

The measured start of a window is noisy, so the start state is a nuisance of the window, eliminated
by an orthogonal projection (a Schur complement), which leaves a log-likelihood of the parameters
alone. For small noise this equals whitening with the start noise propagated through the window,
and it stays right for long ones (docs/reference/identification.md 1.1).
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from leo_diffmodel.compare.pushes import respond
from leo_diffmodel.compare.windows import Array, per_window, Windows
from leo_diffmodel.explain.problem.hypothesis import Hypothesis
from leo_diffmodel.explain.settings import Numerics
from leo_sim.model import Model

if TYPE_CHECKING:
    from leo_diffmodel.explain.problem.problem import Problem


@dataclass(frozen=True)
class Linear:
    """A hypothesis linearised at one point, in units of the measurement noise."""

    residual: Array  # (measured - predicted) / sigma, shape (W, N), N = (K+1) 2J
    by_start: Array  # its sensitivity to the window's start state, shape (W, N, 2J)
    by_theta: Array  # its sensitivity to the parameters, shape (W, N, P)


def sensitivities(model: Model, windows: Windows, start: Array) -> tuple[Array, Array]:
    """Predictions (W, K+1, 2J) and their sensitivity to the start states, (W, K+1, 2J, 2J)."""
    no_torques = np.zeros((0, *windows.dt.shape, windows.q.shape[-1]))
    return respond(model, windows, start, no_torques)


def whiten(windows: Windows, predicted: Array, sigma: Array, farthest: float) -> Array:
    """(measured - predicted) / sigma with time and channel in one axis, shape (..., W, N).

    Cut at `farthest`: a hypothesis may send a robot to infinity.
    """
    with np.errstate(over='ignore'):
        scaled = (windows.measured - predicted) / per_window(sigma, windows)
    scaled = np.nan_to_num(np.clip(scaled, -farthest, farthest), nan=farthest)
    return scaled.reshape(*scaled.shape[:-2], -1)


def linearise(
    problem: Problem,
    hypothesis: Hypothesis,
    theta: Array,
    start: Array,
    by_start: Array | None,
    errors: Array | None,
) -> Linear:
    """The residual of a hypothesis, and its derivatives by one rollout of states that are near.

    See `Problem.linearised`. Start states are moved by half their noise, parameters as far as
    `difference_steps` says.
    """
    together, states = hypothesis.together, start.shape[-1] if by_start is None else 0
    nudge = 0.5 * problem.sigma.min(axis=0)
    step = difference_steps(hypothesis, theta, errors, problem.numerics)
    rough, rows = problem.rough, 1 + states + len(together)
    starts = np.broadcast_to(start, (rows, *start.shape)).copy()
    thetas = np.broadcast_to(theta, (rows, len(theta))).copy()
    for i in range(states):
        starts[1 + i, :, i] += nudge[i]
    for row, some in enumerate(together, 1 + states):
        thetas[row, some] += step[some]
    e = problem.residual(starts, hypothesis.model(rough, thetas), near=True)
    residual = e[0]
    if rough is not problem.base:
        residual = problem.residual(start, hypothesis.model(problem.base, theta))
    if by_start is None:
        by_start = np.stack([(e[1 + i] - e[0]) / nudge[i] for i in range(states)], axis=-1)
    by_theta = np.zeros((*e[0].shape, len(theta)))
    for row, some in enumerate(together, 1 + states):
        for i in some:
            name = hypothesis.recordings[i]
            seen = problem.windows.of(name) if name else slice(None)
            by_theta[seen, :, i] = (e[row, seen] - e[0, seen]) / step[i]
    return Linear(residual, by_start, by_theta)


def difference_steps(
    hypothesis: Hypothesis, theta: Array, errors: Array | None, numerics: Numerics
) -> Array:
    """Finite steps: as far as the data can tell a parameter, turned off the bounds.

    A law with a corner (dry friction, a dead zone) is straight only between two samples that
    change sides; a step that holds many of these sees the slope that the loss has over the width
    of its minimum. Without standard errors a small share of what it is away from neutral, or of
    itself where that is less: a limit is neutral where it is as good as none.
    """
    size, away = np.abs(theta), np.abs(theta - hypothesis.neutral)
    away = np.where(size > 0, np.minimum(away, size), away)
    step = numerics.difference * np.maximum(away, 1e-2 * np.maximum(size, 1e-6))
    step = np.maximum(step, numerics.least_turn * hypothesis.turns)
    if errors is not None:
        width, longest = hypothesis.high - hypothesis.low, numerics.longest_difference
        known = np.where(np.isfinite(width), longest * width, 0.0)
        most = np.maximum(np.maximum(size, away), known)
        step = np.clip(errors, step, np.maximum(step, longest * most))
    return np.where(theta + step > hypothesis.high, -step, step)


def eliminate(linear: Linear, weight: Array | None = None) -> tuple[Array, Array, Array, Array]:
    """Project the start states out.

    Returns:
        residual and by_theta without what the start states explain, then the two maps that give
        the start state's own step: solve (W, 2J) for the residual and gain (W, 2J, P).
    """
    root = 1.0 if weight is None else np.sqrt(weight)[..., None]
    basis, triangle = np.linalg.qr(linear.by_start * root)
    hidden = np.diagonal(triangle, axis1=-2, axis2=-1) == 0  # a start that does not show stays
    basis = np.where(hidden[..., None, :], 0.0, basis)
    triangle = np.where(hidden[..., None], np.eye(triangle.shape[-1]), triangle)
    residual, by_theta = linear.residual[..., None] * root, linear.by_theta * root
    across = np.swapaxes(basis, -1, -2)
    seen, gain = across @ residual, across @ by_theta
    solve = np.linalg.solve(triangle, seen)[..., 0]
    rest = (residual - basis @ seen)[..., 0]
    return rest, by_theta - basis @ gain, solve, np.linalg.solve(triangle, gain)
