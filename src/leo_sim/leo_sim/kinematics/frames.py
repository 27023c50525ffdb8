# SPDX-License-Identifier: Apache-2.0
"""Where the links of a robot are: frames and points.

Vectors and matrices are tuples of components, where a float 0.0 or 1.0 costs nothing.
Most components of a robot's geometry are exactly zero (planar robots, joint axes along x, y or
z). Written component by component, with products by 0 and 1 skipped, one generic recursion over
the tree does about the arithmetic of hand-written equations, on floats or on arrays.
"""

from collections.abc import Sequence
from typing import Any, NamedTuple

import numpy as np

from leo_sim.common.broadcasting import Array, Numbers
from leo_sim.description.joint import columns, Joint

Vec = tuple[Any, Any, Any]
Mat = Sequence[Any]
ZERO: Vec = (0.0, 0.0, 0.0)  # this very tuple is skipped as a whole


def mul(a: Any, b: Any) -> Any:
    if a.__class__ is float:
        if a == 0.0:
            return 0.0
        if a == 1.0:
            return b
    if b.__class__ is float:
        if b == 0.0:
            return 0.0
        if b == 1.0:
            return a
    return a * b


def add(a: Any, b: Any) -> Any:
    if a.__class__ is float and a == 0.0:
        return b
    if b.__class__ is float and b == 0.0:
        return a
    return a + b


def dot(a: Vec, b: Vec) -> Any:
    return add(add(mul(a[0], b[0]), mul(a[1], b[1])), mul(a[2], b[2]))


def plus(a: Vec, b: Vec) -> Vec:
    if a is ZERO or b is ZERO:
        return b if a is ZERO else a
    return add(a[0], b[0]), add(a[1], b[1]), add(a[2], b[2])


def scaled(factor: Numbers, a: Vec) -> Vec:
    if a is ZERO or (factor.__class__ is float and factor == 0.0):
        return ZERO
    return mul(factor, a[0]), mul(factor, a[1]), mul(factor, a[2])


def turned(r: Mat, a: Vec) -> Vec:
    """Matrix (9 components, row by row) times vector."""
    if a is ZERO:
        return ZERO
    return dot((r[0], r[1], r[2]), a), dot((r[3], r[4], r[5]), a), dot((r[6], r[7], r[8]), a)


def product(r: Mat, s: Mat) -> Mat:
    rows = [(r[0], r[1], r[2]), (r[3], r[4], r[5]), (r[6], r[7], r[8])]
    columns = [(s[0], s[3], s[6]), (s[1], s[4], s[7]), (s[2], s[5], s[8])]
    return tuple(dot(row, column) for row in rows for column in columns)


def symmetric(i: Sequence[Any]) -> Mat:
    """A full matrix from (xx, yy, zz, xy, xz, yz)."""
    xx, yy, zz, xy, xz, yz = i
    return xx, xy, xz, xy, yy, yz, xz, yz, zz


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
