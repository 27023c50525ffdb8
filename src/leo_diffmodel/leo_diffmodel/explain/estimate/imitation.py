# SPDX-License-Identifier: Apache-2.0
"""Torque laws at one place that can do what another one was found to do there.

A scan asks what a small effect does where the model as given goes. A large one takes the robot
elsewhere, and the law that fits there best may look poor from here; one that does what the best of
the others does is not far from it.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from scipy.optimize import least_squares

from leo_diffmodel.explain.estimate.fitted import Fit, Problem
from leo_diffmodel.explain.estimate.hypothesis import Candidate
from leo_diffmodel.explain.estimate.scan import amplitude_indices, Scan
from leo_sim.effects.motor import Motor

Array = np.ndarray
LEFT = 0.05
"""Most that an imitation may leave of the mean squared torque."""
MOST = 3
SAMPLES = 400
NO_MOTOR = Motor(0.0, 0.0)


def imitations(problem: Problem, fitted: Fit, scans: Sequence[Scan]) -> list[Scan]:
    """The laws that come nearest to the last effect of a fit, with the values that do so.

    Args:
        problem: with the states at which they are compared.
        fitted: the fit of the effect beside the others.
        scans: of the candidates; those of another place or of no torque of angle and rate are
            passed over.
    """
    mine, index = fitted.hypothesis.candidates[-1], len(fitted.hypothesis.candidates) - 1
    if not _is_of_state(mine):
        return []
    first, values = fitted.hypothesis.offset(index), fitted.hypothesis.values(fitted.theta, index)
    q, dq = _states(problem, mine.where)
    torque = _torque(mine, np.array([*values.values()]), q, dq)
    near = []
    for scan in scans if torque.any() else ():
        other = scan.candidate
        if other.where == mine.where and other != mine and _is_of_state(other):
            point, left = _nearest(scan, q, dq, torque)
            theta = fitted.theta[:first], point, fitted.theta[first + len(values) :]
            near.append((left, replace(scan, theta=np.concatenate(theta))))
    near = sorted((n for n in near if n[0] < LEFT), key=lambda n: n[0])
    return [scan for _, scan in near[:MOST]]


def _nearest(scan: Scan, q: Array, dq: Array, torque: Array) -> tuple[Array, float]:
    """The parameters with which a law comes nearest to a torque, and the share that it leaves.

    What neither scales nor turns it stays as it was scanned: a ripple of no turns at all would do
    what a constant torque does, and no fit would find the way from there.
    """
    parameters = scan.candidate.parameters
    scaling = amplitude_indices(parameters)
    free = [i for i, p in enumerate(parameters) if i in scaling or p.turns]
    bounds = [np.array([getattr(parameters[i], end) for i in free]) for end in ('low', 'high')]
    size = np.sqrt((torque**2).mean())

    def beside(values: Array, point: Array) -> Array:
        point[free] = values
        return (_torque(scan.candidate, point, q, dq) - torque) / size

    best, least = scan.points[0], np.inf
    for point in scan.points.copy():
        start = np.clip(point[free], *bounds)
        if np.isfinite(beside(start, point)).all():
            found = least_squares(beside, start, bounds=bounds, args=(point,))
            left = float((beside(found.x, point) ** 2).mean())
            best, least = (point, left) if left < least else (best, least)
    return best, least


def _is_of_state(candidate: Candidate) -> bool:
    """Whether its law is a torque that angle and rate of its joint decide."""
    e = candidate.effect
    return e.hook == 'torque' and not (e.motor_side or e.uses_load or e.remembers)


def _torque(candidate: Candidate, point: Array, q: Array, dq: Array) -> Array:
    names = [p.name for p in candidate.parameters]
    values = dict(zip(names, point, strict=True))
    return np.asarray(candidate.effect.torque(values, q, dq, NO_MOTOR, 0.0))


def _states(problem: Problem, where: str) -> tuple[Array, Array]:
    """Some of the measured angles and rates of the joints of a place."""
    names = problem.base.robot.joint_names
    joints = [i for i, name in enumerate(names) if where in ('all', name)]
    q, dq = (x[..., joints].ravel() for x in (problem.windows.q, problem.windows.dq))
    some = np.linspace(0, len(q) - 1, min(SAMPLES, len(q))).astype(int)
    return q[some], dq[some]
