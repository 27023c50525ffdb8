# SPDX-License-Identifier: Apache-2.0
"""Start poses of a robot: drawn, and put on the ground."""
from __future__ import annotations

from functools import cached_property
from typing import Any

import numpy as np

from leo_msgs_py.errors import UserError
from leo_sim.gait import Gait
from leo_sim.names import nearest
from leo_sim.robot import Robot
from leo_sim.robot_file import PoseFile


class Starts:
    """The start poses of a robot."""

    def __init__(self, robot: Robot):
        self._robot = robot

    def pose(self, name: str) -> PoseFile:
        """The pose of that name.

        Raises:
            UserError: Unknown pose, naming the nearest one.
        """
        poses = self._robot.start_poses
        if name not in poses:
            raise UserError(f'{self._robot.name} has no start pose {name!r}{nearest(name, poses)}')
        return poses[name]

    def draw(self, name: str, rng: np.random.Generator) -> tuple[np.ndarray, np.ndarray]:
        """Angles and rates (J,) of a pose, ranges drawn, the lowest contact on the ground.

        Raises:
            UserError: Unknown pose.
        """
        pose, joints = self.pose(name), self._robot.joint_names
        q, dq = (np.array([_drawn(values.get(joint, 0.0), rng) for joint in joints])
                 for values in (pose.angles, pose.rates))
        if pose.on_ground:
            slope = self._robot.constants['ground.slope'].value
            q[1] -= self._gait.clearance(q) / np.cos(slope)
        return q, dq

    @cached_property
    def _gait(self) -> Gait:
        return Gait(self._robot)


def _drawn(value: Any, rng: np.random.Generator) -> float:
    return float(rng.uniform(*value)) if isinstance(value, tuple) else float(value)
