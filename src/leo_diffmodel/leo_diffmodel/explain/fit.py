# SPDX-License-Identifier: Apache-2.0
"""Fit a hypothesis on the training windows and score it on the held-out ones."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from leo_diffmodel.compare.windows import Windows
from leo_diffmodel.explain import shooting
from leo_diffmodel.explain.hypothesis import Hypothesis
from leo_sim.model import Model

Array = np.ndarray


@dataclass(frozen=True)
class Problem:
    """What every hypothesis is judged on.

    Attributes:
        base: the model as it stands.
        windows: the data, training and held-out.
        sigma: measurement noise of each channel (angles, then rates), shape (2J,).
        train: which windows a fit may see, shape (W,).
    """

    base: Model
    windows: Windows
    sigma: Array
    train: Array


@dataclass(frozen=True)
class Fit:
    """A fitted hypothesis.

    Attributes:
        hypothesis: what was free.
        theta: its parameters, shape (P,).
        covariance: of theta, from the training windows, shape (P, P).
        start: start states, shape (W, 2J).
        loss: robust cost of each window [nats], shape (W,).
        residual: whitened, start states projected out, shape (W, N).
    """

    hypothesis: Hypothesis
    theta: Array
    covariance: Array
    start: Array
    loss: Array
    residual: Array

    def ci95(self, index: int) -> tuple[float, float]:
        """95 % confidence interval of parameter `index`, within its bounds."""
        half = 1.96 * float(np.sqrt(max(self.covariance[index, index], 0.0)))
        low, high = self.hypothesis.low[index], self.hypothesis.high[index]
        value = float(self.theta[index])
        return max(value - half, float(low)), min(value + half, float(high))


def fit(
    problem: Problem,
    hypothesis: Hypothesis,
    theta: Array | None = None,
    start: Array | None = None,
    iterations: int = 8,
) -> Fit:
    """Gauss-Newton over parameters and start states, with step halving and bounds.

    Only the training windows move the parameters; every window moves its own start state.
    """
    theta = hypothesis.neutral if theta is None else theta
    start = problem.windows.measured[:, 0] if start is None else start
    best = _evaluate(problem, hypothesis, theta, start)
    step_theta, step_start = _step(problem, best)
    scale = 1.0
    for _ in range(iterations):
        trial = _evaluate(
            problem,
            hypothesis,
            np.clip(best.theta + scale * step_theta, hypothesis.low, hypothesis.high),
            best.start + scale * step_start,
        )
        gained = _training_loss(problem, best) - _training_loss(problem, trial)
        if gained < 0:
            scale *= 0.4
            continue
        best, scale = trial, min(1.0, 2 * scale)
        step_theta, step_start = _step(problem, best)
        if gained < 0.02:
            break
    return best.finish(problem)


@dataclass(frozen=True)
class _Point:
    hypothesis: Hypothesis
    theta: Array
    start: Array
    linear: shooting.Linear
    loss: Array

    def finish(self, problem: Problem) -> Fit:
        residual, by_theta, _, _ = shooting.eliminate(self.linear)
        information = _gram(by_theta[problem.train])
        return Fit(
            self.hypothesis,
            self.theta,
            np.linalg.pinv(information) if len(self.theta) else np.zeros((0, 0)),
            self.start,
            self.loss,
            residual,
        )


def _evaluate(problem: Problem, hypothesis: Hypothesis, theta: Array, start: Array) -> _Point:
    linear = shooting.linearise(
        problem.base, problem.windows, problem.sigma, hypothesis, theta, start
    )
    return _Point(hypothesis, theta, start, linear, shooting.huber(linear.residual))


def _training_loss(problem: Problem, point: _Point) -> float:
    return float(point.loss[problem.train].sum())


def _step(problem: Problem, point: _Point) -> tuple[Array, Array]:
    """The Gauss-Newton step of parameters and start states."""
    rest, _, _, _ = shooting.eliminate(point.linear)
    weight = shooting.robust_weight(rest)
    residual, by_theta, start, gain = shooting.eliminate(point.linear, weight)
    step = np.zeros(len(point.theta))
    if len(step):
        columns = by_theta[problem.train]
        slope = np.einsum('wnp,wn->p', columns, residual[problem.train])
        step = -_solve(_gram(columns), slope)
    return step, -start - gain @ step


def _gram(columns: Array) -> Array:
    flat = columns.reshape(columns.shape[0] * columns.shape[1], columns.shape[2])
    return flat.T @ flat


def _solve(matrix: Array, vector: Array) -> Array:
    scale = np.sqrt(np.maximum(np.diag(matrix), 1e-300))
    scaled = matrix / np.outer(scale, scale)
    ridge = 1e-9 * np.eye(len(vector))
    return np.linalg.solve(scaled + ridge, vector / scale) / scale
