# SPDX-License-Identifier: Apache-2.0
"""A fitted hypothesis less some of its effects, by its own linear answer: no rollout, no fit."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import replace

import numpy as np

from leo_diffmodel.explain.estimate.fitted import Fit
from leo_diffmodel.explain.problem import likelihood
from leo_diffmodel.explain.problem.hypothesis import Candidate, Hypothesis
from leo_diffmodel.explain.problem.problem import Problem

Array = np.ndarray


def linear_part(problem: Problem, fitted: Fit, left_out: Iterable[Candidate]) -> Fit:
    """What a fit would be without some effects, as far as predictions answer straight to it.

    The other parameters move to where the training windows ask for, their weights as they are.
    """
    full, out = fitted.hypothesis, {*left_out}
    part = Hypothesis(tuple(c for c in full.candidates if c not in out), full.constants)
    parameters = [(c, p) for c in full.candidates for p in c.parameters]
    gone = np.zeros(full.size, bool)
    gone[: len(parameters)] = [c in out for c, _ in parameters]
    scales = np.zeros(full.size, bool)
    scales[: len(parameters)] = [p.scales for _, p in parameters]
    move = np.where(gone & scales, full.neutral - fitted.theta, 0.0)
    free = ~gone & full.free(fitted.theta)
    move[free] = _answer(problem, fitted, move, free)
    theta = part.bounded((fitted.theta + move)[~gone])
    move[~gone] = theta - fitted.theta[~gone]
    residual = fitted.residual + fitted.columns @ move
    typical, channels = problem.typical_of(residual), fitted.start.shape[-1]
    kept, lost = np.ix_(~gone, ~gone), np.ix_(gone, gone)
    across = fitted.covariance[np.ix_(~gone, gone)]
    known = across @ np.linalg.pinv(fitted.covariance[lost]) @ across.T
    return replace(
        fitted,
        hypothesis=part,
        theta=theta,
        covariance=fitted.covariance[kept] - known,
        beyond=fitted.beyond[~gone],
        loss=likelihood.loss(residual, channels, problem.numerics, typical),
        residual=residual,
        columns=fitted.columns[..., ~gone],
        typical=typical,
        certificate=None,
    )


def _answer(problem: Problem, fitted: Fit, move: Array, free: Array) -> Array:
    """How far the free parameters follow when others move, shape (F,)."""
    channels, train = fitted.start.shape[-1], problem.train
    weight = likelihood.robust_weight(
        fitted.residual[train], channels, problem.numerics, fitted.typical
    )
    columns = (fitted.columns[train] * np.sqrt(weight)[..., None]).reshape(-1, len(move))
    mine = columns[:, free]
    size = np.maximum(np.sqrt((mine**2).sum(axis=0)), 1e-12)
    square = mine.T @ mine / np.outer(size, size) + 1e-9 * np.eye(len(size))
    return np.asarray(-np.linalg.solve(square, mine.T @ (columns @ move) / size) / size)
