# SPDX-License-Identifier: Apache-2.0
"""Joints that mimic another: both are one coordinate, that of the joint which is copied.

A joint that mimics has the angle ratio * q + offset, where q is the angle of its leader. The
offset goes into its frame, so that it is at angle 0 where its leader is; the ratio stays.
"""

from collections.abc import Mapping, Sequence
from dataclasses import replace
import math
from xml.etree import ElementTree

import numpy as np

from leo_sim.description.joint import Joint

MOST = 1e4
"""Largest multiplier that is taken: no gear between two joints of a robot is as high."""


def mimics(element: ElementTree.Element) -> tuple[str, float, float] | None:
    """The joint that a `<joint>` copies, multiplier and offset rad (m); None where it is free.

    Raises:
        ValueError: No number, or no joint named.
    """
    found = element.find('mimic')
    if found is None or element.get('type') == 'fixed':
        return None
    if not (leader := found.get('joint')):
        raise ValueError('its <mimic> names no joint; give it joint="..."')
    ratio, offset = (
        float(found.get(key) or default) for key, default in (('multiplier', 1.0), ('offset', 0.0))
    )
    if not (math.isfinite(offset) and 1 / MOST <= abs(ratio) <= MOST):
        raise ValueError(
            f'<mimic>: multiplier {ratio:g}, offset {offset:g}: the multiplier is '
            f'{1 / MOST:g} to {MOST:g} in size, the offset finite'
        )
    return leader, ratio, offset


def coupled(
    joints: Sequence[Joint], copied: Mapping[str, tuple[str, float, float]]
) -> list[Joint]:
    """Joints with those that copy others bound to the one that moves by itself.

    Args:
        joints: As the URDF has them.
        copied: By joint that mimics: whom, multiplier and offset.

    Raises:
        ValueError: It copies no joint, one that is fixed, or itself in a circle.
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


def _leader(
    name: str, copied: Mapping[str, tuple[str, float, float]], by_name: Mapping[str, Joint]
) -> tuple[str, float, float]:
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
        rotation = rotation @ _turned(joint.axis, offset)
    x, y, z = place.tolist()
    return replace(
        joint,
        rotation=tuple(rotation.ravel().tolist()),
        translation=(x, y, z),
        leader=leader,
        ratio=ratio,
        damping=0.0,
    )


def _turned(axis: tuple[float, float, float], angle: float) -> np.ndarray:
    """Rotation about a unit vector, by Rodrigues."""
    x, y, z = axis
    skew = np.array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]])
    return np.asarray(np.eye(3) + np.sin(angle) * skew + (1 - np.cos(angle)) * skew @ skew)
