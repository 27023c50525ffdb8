# SPDX-License-Identifier: Apache-2.0
"""Torque laws at one place that can do what another one was found to do there.

A scan sees small effects where the model as given goes; a large one takes the robot elsewhere, and
the law that fits best there may look poor from here. It is not far from one that does the same.
"""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from scipy.optimize import least_squares

from leo_diffmodel.compare.windows import Array, evenly
from leo_diffmodel.explain.estimate.fitted import Fit
from leo_diffmodel.explain.estimate.scan import Scan
from leo_diffmodel.explain.problem.hypothesis import Candidate
from leo_diffmodel.explain.problem.problem import Problem
from leo_sim.effects.motor import Motor


def imitations(problem: Problem, fitted: Fit, scans: Sequence[Scan]) -> list[Scan]:
    """The laws that come nearest to the last effect of a fit, with the values that do so."""
    law, index = fitted.hypothesis.candidates[-1], len(fitted.hypothesis.candidates) - 1
    if not _is_of_state(law):
        return []
    first, after = fitted.hypothesis.offset(index), fitted.hypothesis.first_constant
    values, (q, dq) = fitted.theta[first:after], _states(problem, law.where)
    torque = _torque(law, values, q, dq)
    others: list[tuple[float, Scan]] = []
    wholes: list[tuple[float, Scan]] = []
    for scan in scans if torque.any() else ():
        if scan.candidate.where != law.where or not _is_of_state(scan.candidate):
            continue
        itself = scan.candidate == law
        for points in _other_wholes(scan, values) if itself else [scan.points]:
            point, left = _nearest(scan.candidate, points, q, dq, torque)
            theta = np.concatenate([fitted.theta[:first], point, fitted.theta[after:]])
            (wholes if itself else others).append((left, replace(scan, theta=theta)))
    numerics = problem.numerics
    counts = ((others, numerics.imitations), (wholes, numerics.imitations_whole))
    return [
        scan
        for near, count in counts
        for left, scan in sorted(near, key=lambda n: n[0])[:count]
        if left < numerics.imitation_left
    ]


def _other_wholes(scan: Scan, values: Array) -> list[Array]:
    """The scanned points of a law, by its whole numbers; without those that it has.

    Where a joint moves through less than a period, other numbers of periods in a turn do the same.
    """
    whole = [i for i, p in enumerate(scan.candidate.parameters) if p.whole]
    kinds = np.unique(scan.points[:, whole], axis=0) if whole else ()
    return [
        scan.points[(scan.points[:, whole] == kind).all(axis=1)]
        for kind in kinds
        if (kind != values[whole]).any()
    ]


def _nearest(
    candidate: Candidate, points: Array, q: Array, dq: Array, torque: Array
) -> tuple[Array, float]:
    """The values with which a law comes nearest to a torque, and the share that it leaves.

    What neither scales nor turns it stays as scanned: no fit finds back from a ripple of no turns.
    """
    parameters = candidate.parameters
    free = [i for i, p in enumerate(parameters) if p.scales or p.turns]
    bounds = [np.array([getattr(parameters[i], end) for i in free]) for end in ('low', 'high')]
    size = np.sqrt((torque**2).mean())

    def off(values: Array, point: Array) -> Array:
        point[free] = values
        return (_torque(candidate, point, q, dq) - torque) / size

    best, least = points[0], np.inf
    for point in points.copy():
        start = np.clip(point[free], *bounds)
        if np.isfinite(off(start, point)).all():
            found = least_squares(off, start, bounds=bounds, args=(point,))
            left = float((off(found.x, point) ** 2).mean())
            best, least = (point, left) if left < least else (best, least)
    return best, least


def _is_of_state(candidate: Candidate) -> bool:
    e = candidate.effect
    return e.hook == 'torque' and not (e.motor_side or e.uses_load or e.remembers)


def _torque(candidate: Candidate, point: Array, q: Array, dq: Array) -> Array:
    names = [p.name for p in candidate.parameters]
    values = dict(zip(names, point, strict=True))
    return np.asarray(candidate.effect.torque(values, q, dq, Motor(0.0, 0.0), 0.0))


def _states(problem: Problem, where: str) -> tuple[Array, Array]:
    names = problem.base.robot.joint_names
    joints = [i for i, name in enumerate(names) if where in ('all', name)]
    q, dq = (x[..., joints].ravel() for x in (problem.windows.q, problem.windows.dq))
    some = evenly(len(q), problem.numerics.imitation_samples)
    return q[some], dq[some]
