# SPDX-License-Identifier: Apache-2.0
"""What a walker's reward and end look at: centre of mass, ankles, feet on the ground."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from leo_sim.common.broadcasting import Array
from leo_sim.description.constants import bodies
from leo_sim.description.robot import Contact, Robot
from leo_sim.kinematics.plane import Plane, Points


class Gait:
    """Kinematic figures of a planar robot, over any leading axes of its angles (..., J).

    Args:
        robot: With a planar base.
        slope: Of the ground, rad; the robot's own when None.

    Attributes:
        slope: The same.
    """

    def __init__(self, robot: Robot, slope: float | None = None):
        self._plane = Plane(robot.joints)
        if slope is None:
            slope = robot.constants['ground.slope'].value if robot.contacts else 0.0
        self.slope = slope
        self._centre = _centre_of_mass(robot, self._plane)
        self._ankles = self._plane.points([(foot, 0.0, 0.0) for foot in robot.feet])
        feet = [[c for c in robot.contacts if c.link == foot] for foot in robot.feet]
        self._soles = [Soles(self._plane, contacts, slope) for contacts in feet]
        self._feet = Soles(self._plane, [c for contacts in feet for c in contacts], slope)
        self._heights = {
            joint.name: self._plane.points([(joint.child, 0.0, 0.0)]) for joint in robot.joints
        }
        self._touching = Soles(self._plane, robot.contacts, slope)

    def com_x(self, q: Array) -> Any:
        """Of the centre of mass, m, (...)."""
        return self._centre(q)[0][..., 0]

    def com(self, q: Array) -> Any:
        """X and z of the centre of mass, m, (..., 2)."""
        return np.concatenate(self._centre(q), axis=-1)

    def clearance(self, q: Array) -> Any:
        """Distance from the ground to the lowest contact, m, (...); negative when pressed in."""
        return self._touching.clearance(q)

    def stance(self, q: Array, before: Any) -> Any:
        """Which of two feet carries, 0 or 1, (...).

        The one that touches; of two the one in front; of none the one of `before`.
        """
        left, right = (soles.clearance(q) <= 0 for soles in self._soles)
        ankles = self._ankles(q)[0]
        front = np.where(ankles[..., 1] > ankles[..., 0], 1, 0)
        return np.where(left & right, front, np.where(left, 0, np.where(right, 1, before)))

    def stride(self, q: Array, stance: Any) -> Any:
        """X of the swing ankle minus x of the stance ankle, m, (...)."""
        ankles = self._ankles(q)[0]
        apart = ankles[..., 1] - ankles[..., 0]
        return np.where(np.asarray(stance) == 0, apart, -apart)

    def height_over_feet(self, joint: str, q: Array) -> Any:
        """Height of a joint over the lowest point of the feet, m, (...)."""
        return self._heights[joint](q)[1][..., 0] - self._feet.lowest(q)


class Soles:
    """Spheres over the ground."""

    def __init__(self, plane: Plane, contacts: Sequence[Contact], slope: float):
        self._centres = plane.points([(c.link, c.x, c.z) for c in contacts])
        self._radii = np.array([c.radius for c in contacts])
        self._normal = -np.sin(slope), np.cos(slope)

    def clearance(self, q: Array) -> Any:
        """Distance from the ground to the nearest of them, m, (...)."""
        x, z = self._centres(q)
        return np.min(self._normal[0] * x + self._normal[1] * z - self._radii, axis=-1)

    def lowest(self, q: Array) -> Any:
        """Lowest height, m, (...)."""
        return np.min(self._centres(q)[1] - self._radii, axis=-1)


def _centre_of_mass(robot: Robot, plane: Plane) -> Points:
    values = {path: constant.value for path, constant in robot.constants.items()}
    links = bodies(robot.links, robot.joints, values)
    total = sum(body.mass for body in links.values())
    points = plane.points([(name, b.com[0], b.com[2]) for name, b in links.items()])
    return points.mean([body.mass / total for body in links.values()])
