# SPDX-License-Identifier: Apache-2.0
"""Where the links of a robot are: frames and points."""

from collections.abc import Sequence
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from leo_sim.common.broadcasting import Array
from leo_sim.description.joint import columns, Joint


def product(r: Array, s: Array) -> Array:
    """Of matrices, with sums in the order of their components."""
    return np.asarray((r[..., None] * s[..., None, :, :]).sum(axis=-2))


def symmetric(i: Sequence[Any]) -> Sequence[Any]:
    """A full matrix from (xx, yy, zz, xy, xz, yz)."""
    xx, yy, zz, xy, xz, yz = i
    return xx, xy, xz, xy, yy, yz, xz, yz, zz


class Frame(NamedTuple):
    """A link in the world or its parent: rotation (..., 3, 3) and origin m, (..., 3)."""

    rotation: Array
    origin: Array

    def point(self, local: ArrayLike) -> Array:
        """A point given in link axes, in the outer axes, m."""
        return self.origin + (self.rotation * np.asarray(local)[..., None, :]).sum(axis=-1)


class Kinematics:
    """Positions of the links of a tree, over any leading axes of the angles."""

    def __init__(self, joints: Sequence[Joint]):
        self._joints = joints
        self._root = next(j.parent for j in joints if j.parent not in {k.child for k in joints})
        self._parts = [turning_parts(joint).reshape(3, 3, 3) for joint in joints]
        self._columns = columns(joints)

    def frames(self, q: Array) -> dict[str, Frame]:
        """The frame of every link at angles q (..., J)."""
        q = np.asarray(q, dtype=float)
        frames = {self._root: Frame(np.eye(3), np.zeros(3))}
        for joint, parts, column in zip(self._joints, self._parts, self._columns, strict=True):
            parent = frames[joint.parent]
            angle = 0.0 if column < 0 else joint.ratio * q[..., column]
            inside = placed(joint, parts, np.asarray(angle)[..., None])
            turned = product(parent.rotation, inside.rotation)
            frames[joint.child] = Frame(turned, parent.point(inside.origin))
        return frames


def turning_parts(joint: Joint) -> Array:
    """R0 (a a'), R0 (1 - a a') and R0 [a]x, row by row: R = first + cos q second + sin q third."""
    x, y, z = joint.axis
    outer = np.outer(joint.axis, joint.axis)
    skew = np.array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]])
    parts = np.stack([outer, np.eye(3) - outer, skew])
    return product(np.reshape(joint.rotation, (3, 3)), parts).reshape(3, 9)


def placed(joint: Joint, parts: Array, angle: Array) -> Frame:
    """A child link in its parent at an angle (rad, m), (..., 1), of the joint between them."""
    turned, at = np.reshape(joint.rotation, (3, 3)), np.asarray(joint.translation)
    if joint.kind == 'fixed':
        return Frame(turned, at)
    if joint.kind == 'prismatic':
        return Frame(turned, at + angle * Frame(turned, np.zeros(3)).point(joint.axis))
    first, second, third = parts
    angle = angle[..., None]
    return Frame(first + np.cos(angle) * second + np.sin(angle) * third, at)
