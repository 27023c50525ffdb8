# SPDX-License-Identifier: Apache-2.0
"""Where the links of a robot are: frames, points, the centre of mass, heights over the ground."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import NamedTuple

import numpy as np

from leo_sim.common.broadcasting import Array, Numbers
from leo_sim.description.joint import columns, Joint
from leo_sim.description.urdf import Body
from leo_sim.kinematics.components import add, Mat, mul, plus, product, scaled, turned, Vec, ZERO

UNIT: Mat = (1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0)


class Frame(NamedTuple):
    """A link in the world or its parent: rotation (9 components, row by row) and origin m."""

    rotation: Mat
    origin: Vec

    def point(self, local: Vec) -> Vec:
        """A point given in link axes, in the outer axes, m."""
        return plus(self.origin, turned(self.rotation, local))


class Kinematics:
    """Positions of the links of a tree, over any leading axes of the angles."""

    def __init__(self, joints: Sequence[Joint]):
        self._joints = joints
        self._root = next(j.parent for j in joints if j.parent not in {k.child for k in joints})
        self._parts = [turning_parts(joint) for joint in joints]
        self._columns = columns(joints)

    def frames(self, q: Array) -> dict[str, Frame]:
        """The frame of every link at angles q (..., J)."""
        q = np.asarray(q, dtype=float)
        angles = q.tolist() if q.ndim == 1 else np.moveaxis(q, -1, 0)
        frames = {self._root: Frame(UNIT, ZERO)}
        for joint, parts, column in zip(self._joints, self._parts, self._columns, strict=True):
            parent = frames[joint.parent]
            angle = 0.0 if column < 0 else joint.ratio * angles[column]
            inside = placed(joint, parts, angle)
            frames[joint.child] = Frame(
                product(parent.rotation, inside.rotation), parent.point(inside.origin)
            )
        return frames


def centre_of_mass(frames: Mapping[str, Frame], bodies: Mapping[str, Body]) -> Vec:
    """Of all links together, m."""
    total, weighted = 0.0, ZERO
    for name, body in bodies.items():
        total = total + body.mass
        weighted = plus(weighted, scaled(body.mass, frames[name].point(body.com)))
    return scaled(1.0 / total, weighted)


def turning_parts(joint: Joint) -> tuple[Mat, Mat, Mat]:
    """R0 (a a'), R0 (1 - a a') and R0 [a]x: R = first + cos q second + sin q third."""
    x, y, z = joint.axis
    outer = (x * x, x * y, x * z, y * x, y * y, y * z, z * x, z * y, z * z)
    rest = tuple(u - o for u, o in zip(UNIT, outer, strict=True))
    skew = (0.0, -z, y, z, 0.0, -x, -y, x, 0.0)
    first, second, third = (product(joint.rotation, part) for part in (outer, rest, skew))
    return first, second, third


def placed(joint: Joint, parts: tuple[Mat, Mat, Mat], angle: Numbers) -> Frame:
    """A child link in its parent at an angle (rad, m) of the joint between them."""
    if joint.kind == 'fixed':
        return Frame(joint.rotation, joint.translation)
    if joint.kind == 'prismatic':
        slide = scaled(angle, turned(joint.rotation, joint.axis))
        return Frame(joint.rotation, plus(joint.translation, slide))
    cosine, sine = np.cos(angle), np.sin(angle)
    rotation = tuple(
        add(add(a, mul(cosine, b)), mul(sine, c)) for a, b, c in zip(*parts, strict=True)
    )
    return Frame(rotation, joint.translation)
