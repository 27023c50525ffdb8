# SPDX-License-Identifier: Apache-2.0
"""Whether a robot that is put up by hand is in its start pose."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np

from leo_msgs_py.errors import UserError
from leo_sim.common.names import nearest
from leo_sim.description.robot import Robot


def pose_of(robot: Robot, name: str) -> dict[str, tuple[float, float]]:
    """Lowest and highest angle [rad or m] of each joint that a start pose names.

    Raises:
        UserError: there is no such pose.
    """
    if name not in robot.start_poses:
        near = nearest(name, robot.start_poses)
        raise UserError(f'{robot.name} has no start pose {name!r}{near}')
    angles = robot.start_poses[name].angles
    return {
        joint: drawn if isinstance(drawn, tuple) else (drawn, drawn)
        for joint, drawn in angles.items()
    }


def farthest(
    pose: Mapping[str, tuple[float, float]], joints: Sequence[str], angles: np.ndarray
) -> tuple[str, float]:
    """The joint that is farthest from a pose, and by how much [rad or m]; infinity unmeasured."""
    off = {
        joint: max(pose[joint][0] - angle, angle - pose[joint][1], 0.0)
        if np.isfinite(angle)
        else np.inf
        for joint, angle in zip(joints, angles, strict=True)
        if joint in pose
    }
    return max(off.items(), key=lambda item: item[1], default=('', 0.0))
