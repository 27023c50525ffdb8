# SPDX-License-Identifier: Apache-2.0
"""Which joints lack torque, and what that torque is drawn against."""

from __future__ import annotations

import math

import numpy as np

from leo_diffmodel.compare.conditions import folded
from leo_diffmodel.compare.settings import COMPARE
from leo_diffmodel.compare.sizes import length_unit
from leo_diffmodel.compare.torque import MissingTorque
from leo_diffmodel.report.binned import sort
from leo_sim.description.robot import Robot

Array = np.ndarray
MOST_JOINTS = 4
NEARLY = 0.9
LABELS = {'voltage': 'voltage [V]', 'torque': 'commanded torque [N m]', 'position': 'goal [rad]'}


def lacking(missing: MissingTorque) -> list[int]:
    """Joints that lack more than noise, most first; the foremost where none does."""
    count = missing.seen.sum(axis=0)
    square = (missing.torque / missing.spread) ** 2
    if missing.carrying is not None:
        square = np.minimum(square, COMPARE.far)
    mean = square.sum(axis=0) / np.maximum(count, 1)
    order = [int(j) for j in np.argsort(-mean)]
    beyond = 1.0 + COMPARE.standard_errors * np.sqrt(2.0 / np.maximum(count, 1))
    return [j for j in order if mean[j] > beyond[j]][:MOST_JOINTS] or order[:1]


def variables(missing: MissingTorque, robot: Robot, joint: int) -> list[tuple[str, Array]]:
    """Abscissae with their labels; the input only where the joint has one that changes."""
    name = robot.joint_names[joint]
    unit = length_unit(robot, name)
    place = (
        _angle(name, missing.q[:, joint])
        if unit == 'rad'
        else (f'{name} position [m]', missing.q[:, joint])
    )
    found = [(f'{name} speed [{unit}/s]', missing.dq[:, joint]), place]
    if joint in robot.actuated:
        values = missing.inputs[:, robot.actuated.index(joint)]
        if np.ptp(values) > 0:
            found.append((f'{name} {LABELS[robot.input]}', values))
    return found


def that_matters(missing: MissingTorque, robot: Robot, joint: int) -> int:
    """The first abscissa, by its place, whose means say nearly as much of a torque as any."""
    seen = missing.seen[:, joint]
    torque = missing.torque[seen, joint]
    told = [sort(v[seen]).explained(torque) for _, v in variables(missing, robot, joint)]
    return next(i for i, share in enumerate(told) if share >= NEARLY * max(told))


def _angle(name: str, q: Array) -> tuple[str, Array]:
    """The angle, folded into one turn where the joint went around."""
    within = '' if np.ptp(q) <= math.tau else ' within a turn'
    return f'{name} angle{within} [rad]', folded(q)
