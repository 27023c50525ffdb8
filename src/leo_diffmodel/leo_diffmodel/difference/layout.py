# SPDX-License-Identifier: Apache-2.0
"""The state vector the difference network works on: 3 numbers for the pendulum, 18 for LEO."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from leo_sim.description.robot import Robot


@dataclass(frozen=True)
class Layout:
    """Cos and sin of every continuous joint, the angle of every other one, then all rates.

    Attributes:
        continuous: whether each joint turns without end, length J.
        planar: whether joint 0 is the base's horizontal slide, on which nothing depends.
        actuators: number of inputs A.
    """

    continuous: tuple[bool, ...]
    planar: bool
    actuators: int

    @property
    def states(self) -> int:
        """Length of the state vector."""
        return 2 * len(self.continuous) + sum(self.continuous)

    def state(self, q: np.ndarray, dq: np.ndarray) -> np.ndarray:
        """State vector (..., states) of joint angles and rates (..., J)."""
        turning = np.array(self.continuous)
        angles = q[..., turning]
        return np.concatenate([np.cos(angles), np.sin(angles), q[..., ~turning], dq], axis=-1)

    def network_input(self, q: np.ndarray, dq: np.ndarray, inputs: np.ndarray) -> np.ndarray:
        """State vector and input (..., states + A), the base's x left out of account."""
        if self.planar:
            q = q.copy()
            q[..., 0] = 0.0
        return np.concatenate([self.state(q, dq), inputs], axis=-1)

    def moved(
        self, q: np.ndarray, dq: np.ndarray, difference: np.ndarray
    ) -> tuple[np.ndarray, np.ndarray]:
        """Joint angles and rates after adding `difference` (..., states) to their state vector.

        A continuous joint stays within half a turn of where it was.
        """
        turning, state = np.array(self.continuous), self.state(q, dq) + difference
        n, joints = int(turning.sum()), len(turning)
        wanted = np.arctan2(state[..., n : 2 * n], state[..., :n])
        moved = q.copy()
        moved[..., turning] += np.angle(np.exp(1j * (wanted - q[..., turning])))
        moved[..., ~turning] = state[..., 2 * n : n + joints]
        return moved, state[..., n + joints :]


def layout_of(robot: Robot) -> Layout:
    """The layout of a robot."""
    kinds = {joint.name: joint.kind for joint in robot.joints}
    return Layout(
        continuous=tuple(kinds[name] == 'continuous' for name in robot.joint_names),
        planar=robot.base == 'planar',
        actuators=len(robot.actuators),
    )


def channel_names(robot: Robot, form: str) -> tuple[str, ...]:
    """What each number of a correction is about, as `left_knee rate` or `left_knee torque`."""
    if form == 'torque':
        return tuple(f'{actuator.joint} torque' for actuator in robot.actuators)
    names, turning = robot.joint_names, layout_of(robot).continuous
    circling = [name for name, turns in zip(names, turning, strict=True) if turns]
    other = [name for name in names if name not in circling]
    angles = [f'{name} angle' for name in [*circling, *circling, *other]]
    return (*angles, *(f'{name} rate' for name in names))
