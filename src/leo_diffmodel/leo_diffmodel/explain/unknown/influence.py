# SPDX-License-Identifier: Apache-2.0
"""How what a fit leaves unexplained would answer to a torque at each joint and instant.

Linear and computed once: whatever a missing torque may depend on, its trace in the data is then
one matrix product (docs/reference/identification.md 1.7).
"""

from dataclasses import dataclass, replace

import numpy as np

from leo_diffmodel.compare.pushes import own, respond, tame
from leo_diffmodel.compare.sizes import torque_scale
from leo_diffmodel.compare.windows import Array, per_window
from leo_diffmodel.explain.estimate.covariance import conditional_errors, leverage_weight
from leo_diffmodel.explain.estimate.fitted import Fit
from leo_diffmodel.explain.problem import likelihood, shooting
from leo_diffmodel.explain.problem.problem import Problem
from leo_sim.model import Model


@dataclass(frozen=True)
class Influence:
    """The whitened residual of a fit and its answer to torques, initial states projected out."""

    residual: Array  # (measured - predicted) / sigma, robustly weighted, shape (W, N)
    root: Array  # the weights, as they multiply it, shape (W, N)
    answer: Array  # change per N m of torque at a joint throughout a stretch, (W, N, G, J)
    by_theta: Array  # change of the prediction per unit of the fit's parameters, shape (W, N, P)
    stretch: Array  # which stretch each interval of a window belongs to, shape (K,)
    q: Array  # predicted angles in the middle of each stretch [rad], shape (W, G, J)
    dq: Array  # predicted rates there [rad/s], shape (W, G, J)
    model: Model  # the fitted model, for states (W, G, J)
    problem: Problem  # the data

    @property
    def runs_away(self) -> bool:
        """Whether a predicted rate is far beyond all measured ones, or no number."""
        measured, far = self.problem.windows.dq, self.problem.numerics.runaway
        return not np.abs(self.dq).max() < far * max(float(np.abs(measured).max()), 1e-9)

    @property
    def time(self) -> Array:
        """Time since the recording began, in the middle of each stretch [s], shape (W, G)."""
        windows = self.problem.windows
        ends = np.cumsum(windows.dt, axis=1)
        return windows.start[:, None] + self.averaged(ends - 0.5 * windows.dt)

    def averaged(self, held: Array) -> Array:
        """Mean over each stretch of what is given per interval (W, K, ...), (W, G, ...)."""
        groups = [held[:, self.stretch == g] for g in range(self.stretch[-1] + 1)]
        return np.stack([g.mean(axis=1) for g in groups], axis=1)


def influence(problem: Problem, fitted: Fit) -> Influence:
    """Linearise a fitted hypothesis by a torque at every joint in every stretch of time."""
    windows, joints, numerics = problem.windows, problem.windows.q.shape[-1], problem.numerics
    hypothesis = fitted.hypothesis
    model = hypothesis.model(problem.base, fitted.theta)
    linear = problem.linearised(
        hypothesis, fitted.theta, fitted.start, conditional_errors(fitted.columns[problem.train])
    )
    most = min(windows.steps, numerics.stretches)
    stretch = np.arange(windows.steps) * most // windows.steps
    size = numerics.small_torque * torque_scale(model.robot)
    torques = _torques(stretch, windows.dt.shape, joints, size)
    predicted, columns = respond(model, windows, fitted.start, torques)
    lost = ~tame(columns)  # an extra torque may throw a robot out of the ground
    predicted[lost], columns[lost] = windows.measured[lost], 0.0
    noise = per_window(problem.noise, windows)[..., None]
    answer = (columns[..., 2 * joints :] / noise).reshape(*linear.residual.shape, -1) / size
    weight = likelihood.robust_weight(fitted.residual, 2 * joints, numerics, fitted.typical)
    weight = leverage_weight(problem, answer)[..., 0] ** 2 * weight
    everything = np.concatenate([linear.by_theta, -answer], axis=-1)
    rest, columns, _, _ = shooting.eliminate(replace(linear, by_theta=everything), weight)
    split = linear.by_theta.shape[-1]
    middle = 0.5 * (predicted[:, 1:] + predicted[:, :-1])
    made = Influence(
        residual=rest,
        root=np.sqrt(weight),
        answer=-columns[..., split:].reshape(*rest.shape, -1, joints),
        by_theta=-columns[..., :split],
        stretch=stretch,
        q=middle[..., :joints],
        dq=middle[..., joints:],
        model=own(model, windows, instants=True),
        problem=problem,
    )
    return replace(made, q=made.averaged(made.q), dq=made.averaged(made.dq))


def _torques(stretch: Array, shape: tuple[int, ...], joints: int, size: float) -> Array:
    """A torque in one stretch at one joint each, shape (G J, W, K, J)."""
    inside = stretch[None, :] == np.arange(stretch[-1] + 1)[:, None]
    torque = np.einsum('gk,ij->gikj', inside.astype(float), size * np.eye(joints))
    torque = torque.reshape(-1, 1, shape[1], joints)
    return np.broadcast_to(torque, (len(torque), *shape, joints))
