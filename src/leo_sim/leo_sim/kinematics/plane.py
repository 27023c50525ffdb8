# SPDX-License-Identifier: Apache-2.0
"""Points of a robot that moves in the x-z plane, as one matrix product over any leading axes.

With phi the absolute pitch of the links, every point is linear in q, cos phi and sin phi.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from leo_msgs_py.errors import UserError
from leo_sim.common.broadcasting import Array
from leo_sim.description.urdf import Joint
from leo_sim.kinematics.frames import Frame, Kinematics

Place = tuple[str, float, float]
"""A link, and x and z in its axes, m."""


class Plane:
    """The plane of a tree whose hinges turn about y, slides above the first hinge.

    Args:
        joints: Of the robot, parents first.

    Raises:
        UserError: A joint leaves the plane, or a slide comes after a hinge.
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

    def points(self, places: Sequence[Place]) -> Points:
        """The map from angles to the places."""
        columns = [self._column(*place) for place in places]
        return Points(
            self._slopes,
            np.stack([c[0] for c in columns], axis=-1),
            np.stack([c[1] for c in columns], axis=-1),
        )

    def _column(self, link: str, x: float, z: float) -> tuple[np.ndarray, np.ndarray]:
        """Start (2,) and weights (2, J + 2 H) of one point."""
        tip = _xz(self._zero[link].point((x, 0.0, z)))
        weights = np.zeros((2, len(self._moving) + 2 * len(self._hinges)))
        for joint in self._chain(link):
            if joint.kind == 'prismatic':
                weights[:, self._moving.index(joint)] = _xz(self._axis(joint))
                continue
            centre = _xz(self._zero[joint.child].origin)
            self._turn(weights, joint, tip - centre)
            tip = centre
        return tip, weights

    def _turn(self, weights: np.ndarray, hinge: Joint, lever: np.ndarray) -> None:
        """Add a lever that turns with a hinge's child link."""
        at = len(self._moving) + self._hinges.index(hinge)
        weights[:, at] = lever
        weights[:, at + len(self._hinges)] = -lever[1], lever[0]

    def _chain(self, link: str) -> list[Joint]:
        """Moving joints from a link to the root."""
        chain = []
        while (joint := self._by_child.get(link)) is not None:
            if joint.kind != 'fixed':
                chain.append(joint)
            link = joint.parent
        return chain

    def _axis(self, joint: Joint) -> Any:
        parent: Frame = self._zero[joint.child]
        return Frame(parent.rotation, (0.0, 0.0, 0.0)).point(joint.axis)

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
        return (
            features @ self._weights[0] + self._start[0],
            features @ self._weights[1] + self._start[1],
        )

    def mean(self, shares: Sequence[float]) -> Points:
        """The one point that is a mean of these with given shares."""
        column = np.array(shares, dtype=float)[:, None]
        return Points(self._slopes, self._start @ column, self._weights @ column)


def _xz(vector: Any) -> np.ndarray:
    return np.array([float(vector[0]), float(vector[2])])
