# SPDX-License-Identifier: Apache-2.0
"""Start poses of a robot: drawn, and put on the ground."""

from typing import Any

import numpy as np

from leo_msgs_py.errors import UserError
from leo_sim.common.names import nearest
from leo_sim.description.robot import Robot
from leo_sim.kinematics.gait import Gait


def start_pose(
    robot: Robot, name: str, rng: np.random.Generator, gait: Gait | None = None
) -> tuple[np.ndarray, np.ndarray]:
    """Angles and rates (J,) of a start pose, with its ranges drawn.

    Args:
        robot: The robot.
        name: Of the pose.
        rng: Random numbers.
        gait: Of a robot with a ground, which a pose `on_ground` touches.

    Raises:
        UserError: Unknown pose, naming the nearest one.
    """
    poses = robot.start_poses
    if name not in poses:
        raise UserError(f'{robot.name} has no start pose {name!r}{nearest(name, poses)}')
    q, dq = (
        np.array([_drawn(values.get(joint, 0.0), rng) for joint in robot.joint_names])
        for values in (poses[name].angles, poses[name].rates)
    )
    if gait is not None and poses[name].on_ground:
        q[1] -= gait.clearance(q) / np.cos(gait.slope)
    return q, dq


def _drawn(value: Any, rng: np.random.Generator) -> float:
    return float(rng.uniform(*value)) if isinstance(value, tuple) else float(value)
