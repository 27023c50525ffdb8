# SPDX-License-Identifier: Apache-2.0
"""What a walker's reward and end look at: centre of mass, ankles, feet on the ground.

Points of a robot that moves in the x-z plane are one matrix product over any leading axes: with
phi the absolute pitch of the links, every point is linear in q, cos phi and sin phi.
"""

from collections.abc import Sequence
from typing import Any

import numpy as np

from leo_msgs_py.errors import UserError
from leo_sim.common.broadcasting import Array
from leo_sim.description.constants import bodies
from leo_sim.description.robot import Contact, Robot
from leo_sim.description.urdf import Joint
from leo_sim.kinematics.frames import Kinematics

XZ = [0, 2]
Place = tuple[str, float, float]  # a link, and x and z in its axes, m


class Plane:
    """The plane of a tree whose hinges turn about y, slides above the first hinge.

    UserError: a hinge leaves the plane.
    """

    def __init__(self, joints: Sequence[Joint]):
        self._zero = Kinematics(joints).frames(np.zeros(sum(j.kind != 'fixed' for j in joints)))
        self._moving = [joint for joint in joints if joint.kind != 'fixed']
        self._by_child = {joint.child: joint for joint in joints}
        self._hinges = [joint for joint in self._moving if joint.kind != 'prismatic']
        self._slopes = np.zeros((len(self._moving), len(self._hinges)))
        for column, hinge in enumerate(self._hinges):
            for joint in self._chain(hinge.child):
                if joint.kind != 'prismatic':
                    self._slopes[self._moving.index(joint), column] = self._sense(joint)

    def points(self, places: Sequence[Place]) -> 'Points':
        columns = zip(*(self._column(*place) for place in places), strict=True)
        return Points(self._slopes, *(np.stack(each, axis=-1) for each in columns))

    def _column(self, link: str, x: float, z: float) -> tuple[np.ndarray, np.ndarray]:
        """Start (2,) and weights (2, J + 2 H) of one point."""
        tip = self._zero[link].point((x, 0.0, z))[XZ]
        weights = np.zeros((2, len(self._moving) + 2 * len(self._hinges)))
        for joint in self._chain(link):
            if joint.kind == 'prismatic':
                weights[:, self._moving.index(joint)] = self._axis(joint)[XZ]
                continue
            centre = self._zero[joint.child].origin[XZ]
            lever, at = tip - centre, len(self._moving) + self._hinges.index(joint)
            weights[:, at] = lever
            weights[:, at + len(self._hinges)] = -lever[1], lever[0]
            tip = centre
        return tip, weights

    def _chain(self, link: str) -> list[Joint]:
        chain = []
        while (joint := self._by_child.get(link)) is not None:
            if joint.kind != 'fixed':
                chain.append(joint)
            link = joint.parent
        return chain

    def _axis(self, joint: Joint) -> Array:
        return self._zero[joint.child].rotation @ np.array(joint.axis)

    def _sense(self, hinge: Joint) -> float:
        """+1 where a positive angle turns x towards z, that is about -y."""
        x, y, z = self._axis(hinge)
        if abs(x) + abs(z) > 1e-9:
            raise UserError(f'joint {hinge.name!r} does not turn about y; a planar robot does')
        return -float(np.sign(y))


class Points:
    """Positions of P points: x and z over any leading axes of the angles (..., J)."""

    def __init__(self, slopes: np.ndarray, start: np.ndarray, weights: np.ndarray):
        self._slopes, self._start, self._weights = slopes, start, weights

    def __call__(self, q: Array) -> tuple[np.ndarray, np.ndarray]:
        """X and z, m, (..., P) each."""
        q = np.asarray(q, dtype=float)
        pitch = q @ self._slopes
        features = np.concatenate([q, np.cos(pitch), np.sin(pitch)], axis=-1)
        x, z = (features @ w + s for w, s in zip(self._weights, self._start, strict=True))
        return x, z

    def mean(self, shares: Sequence[float]) -> 'Points':
        """The one point that is a mean of these with given shares."""
        column = np.array(shares, dtype=float)[:, None]
        return Points(self._slopes, self._start @ column, self._weights @ column)


class Gait:
    """Kinematic figures of a planar robot, over any leading axes of its angles (..., J).

    The slope is that of the ground, rad; the robot's own when None.
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
        self._heights = {j.name: self._plane.points([(j.child, 0.0, 0.0)]) for j in robot.joints}
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
