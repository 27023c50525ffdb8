# SPDX-License-Identifier: Apache-2.0
"""Joints and links of a tree, as plain numbers; joints that mimic others; units of slides.

A joint that mimics has the angle ratio * q + offset, where q is the angle of its leader: both are
one coordinate. The offset goes into its frame, so that it is at angle 0 where its leader is; the
ratio stays.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
import math
from typing import Any, NamedTuple
from xml.etree.ElementTree import Element

import numpy as np

Vector = tuple[float, float, float]
Matrix = tuple[float, ...]
Copied = tuple[str, float, float]  # by a joint: whom, multiplier and offset rad (m)
PAIRS = (('N m', 'N'), ('kg m2', 'kg'), ('rad', 'm'), ('turn', 'm'))
"""Unit of turning, unit of sliding."""
MOST = 1e4  # largest multiplier that is taken: no gear between two joints of a robot is as high


class Body(NamedTuple):
    """Inertial figures of a link, in its link frame, as broadcastable components."""

    mass: Any  # kg
    com: tuple[Any, Any, Any]  # centre of mass, m
    inertia: tuple[Any, Any, Any, Any, Any, Any]  # about it (xx, yy, zz, xy, xz, yz), kg m2
    force: tuple[Any, Any, Any] = (0.0, 0.0, 0.0)  # constant, at it in world axes, N


@dataclass(frozen=True)
class Link:
    name: str
    body: Body


@dataclass(frozen=True)
class Joint:
    """A joint of the tree, parents before children."""

    name: str
    kind: str  # 'revolute', 'continuous', 'prismatic' or 'fixed'
    parent: str  # the name of a link
    child: str
    rotation: Matrix  # joint frame to parent link frame at angle 0, row by row
    translation: Vector  # joint origin in the parent link frame, m
    axis: Vector  # unit vector in the joint frame
    limits: tuple[float, float]  # lowest and highest angle rad (m), infinite for none
    damping: float  # N m s/rad (N s/m); of a joint that is copied with what its copies add
    leader: str = ''  # the joint whose angle it copies; empty for one that is fixed or free
    ratio: float = 1.0  # its angle for 1 rad (m) of the leader

    @property
    def independent(self) -> bool:
        """Whether it is a coordinate of the robot: it moves, and copies no other joint."""
        return self.kind != 'fixed' and not self.leader


def columns(joints: Sequence[Joint]) -> list[int]:
    """Where each joint is in a state vector: a copy where its leader is, -1 for a fixed one."""
    free = {joint.name: i for i, joint in enumerate(j for j in joints if j.independent)}
    return [free.get(joint.leader or joint.name, -1) for joint in joints]


def sliding(unit: str) -> str:
    """The unit on a slide of what has this unit on a hinge: `N m s/rad` is `N s/m`."""
    for turning, along in PAIRS:
        unit = unit.replace(turning, along)
    return unit


def mimics(element: Element) -> Copied | None:
    """The joint that a `<joint>` copies, multiplier and offset rad (m); or ValueError."""
    found = element.find('mimic')
    if found is None or element.get('type') == 'fixed':
        return None
    if not (leader := found.get('joint')):
        raise ValueError('its <mimic> names no joint; give it joint="..."')
    ratio, offset = float(found.get('multiplier') or 1.0), float(found.get('offset') or 0.0)
    if not (math.isfinite(offset) and 1 / MOST <= abs(ratio) <= MOST):
        raise ValueError(
            f'<mimic>: multiplier {ratio:g}, offset {offset:g}: the multiplier is '
            f'{1 / MOST:g} to {MOST:g} in size, the offset finite'
        )
    return leader, ratio, offset


def coupled(joints: Sequence[Joint], copied: Mapping[str, Copied]) -> list[Joint]:
    """Joints with those that copy others bound to the one that moves by itself.

    ValueError: one copies no joint, one that is fixed, or itself in a circle.
    """
    by_name = {joint.name: joint for joint in joints}
    bound = {name: _leader(name, copied, by_name) for name in copied}
    drag = {joint.name: joint.damping for joint in joints}
    for name, (leader, ratio, _) in bound.items():
        drag[leader] += ratio**2 * by_name[name].damping
    return [
        _bound(joint, *bound[joint.name])
        if joint.name in bound
        else replace(joint, damping=drag[joint.name])
        for joint in joints
    ]


def _leader(name: str, copied: Mapping[str, Copied], by_name: Mapping[str, Joint]) -> Copied:
    """Whom a joint copies in the end, through others that copy too."""
    leader, ratio, offset = copied[name]
    passed = {name}
    while leader in copied and leader not in passed:
        passed.add(leader)
        leader, times, more = copied[leader]
        ratio, offset = ratio * times, offset + ratio * more
    if leader in passed:
        raise ValueError(f'joint {name!r}: it mimics itself; make one of the joints free')
    if leader not in by_name or by_name[leader].kind == 'fixed':
        raise ValueError(f'joint {name!r}: it mimics {leader!r}, which is no joint that moves')
    return leader, ratio, offset


def _bound(joint: Joint, leader: str, ratio: float, offset: float) -> Joint:
    rotation, place = np.reshape(joint.rotation, (3, 3)), np.array(joint.translation)
    if joint.kind == 'prismatic':
        place = place + offset * rotation @ joint.axis
    elif offset:
        from scipy.spatial.transform import Rotation  # most robots need none of it

        rotation = rotation @ Rotation.from_rotvec(offset * np.array(joint.axis)).as_matrix()
    x, y, z = place.tolist()
    return replace(
        joint,
        rotation=tuple(rotation.ravel().tolist()),
        translation=(x, y, z),
        leader=leader,
        ratio=ratio,
        damping=0.0,
    )
