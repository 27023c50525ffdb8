# SPDX-License-Identifier: Apache-2.0
"""Start poses of a robot: drawn, and put on the ground."""
from typing import Any

import numpy as np

from leo_msgs_py.errors import UserError
from leo_sim.gait import Gait
from leo_sim.names import nearest
from leo_sim.robot import Robot


def start_pose(robot: Robot, name: str, rng: np.random.Generator, slope: float = 0.0
               ) -> tuple[np.ndarray, np.ndarray]:
    """Angles and rates (J,) of a start pose, with its ranges drawn.

    Args:
        robot: The robot.
        name: Of the pose.
        rng: Random numbers.
        slope: Of the ground that a pose `on_ground` touches, rad.

    Raises:
        UserError: Unknown pose, naming the nearest one.
    """
    poses = robot.start_poses
    if name not in poses:
        raise UserError(f'{robot.name} has no start pose {name!r}{nearest(name, poses)}')
    q, dq = (np.array([_drawn(values.get(joint, 0.0), rng) for joint in robot.joint_names])
             for values in (poses[name].angles, poses[name].rates))
    if poses[name].on_ground:
        q[1] -= Gait(robot, slope).clearance(q) / np.cos(slope)
    return q, dq


def _drawn(value: Any, rng: np.random.Generator) -> float:
    return float(rng.uniform(*value)) if isinstance(value, tuple) else float(value)
