# SPDX-License-Identifier: Apache-2.0
"""Joints that the motors of others turn too: differential wrists, one that is driven through one.

What such a robot's state and logs have is the angle of each joint's own motor, at the joint.
"""

from collections.abc import Mapping
from copy import deepcopy
from xml.etree.ElementTree import Element, SubElement, tostring

from leo_sim.description.urdf import root_of

Ratios = Mapping[str, Mapping[str, float]]
"""By joint, how far it turns for 1 rad of the motors of others, its own at rest."""


def with_coupled(xml: str, ratios: Ratios, source: str) -> str:
    """The URDF with a joint before a coupled one for each other motor, which it mimics.

    They have its place and axis, and links without mass. Names that the URDF lacks are left out;
    `robot_check` tells them.
    """
    if not any(ratios.values()):
        return xml
    root = root_of(xml, source)
    joints = {joint.get('name', ''): joint for joint in root.findall('joint')}
    for name, motors in ratios.items():
        for motor, ratio in motors.items():
            if {name, motor} <= joints.keys():
                _put_before(joints[name], motor, ratio, root)
    return tostring(root, encoding='unicode')


def _put_before(joint: Element, motor: str, ratio: float, root: Element) -> None:
    before = deepcopy(joint)
    name = f'{joint.get("name")}_by_{motor}'
    before.set('name', name)
    for element, end in ((before, 'child'), (joint, 'parent')):
        if (link := element.find(end)) is not None:
            link.set('link', name)
    _remove(before, 'mimic', 'dynamics')
    _remove(joint, 'origin')
    SubElement(before, 'mimic', {'joint': motor, 'multiplier': repr(ratio)})
    SubElement(root, 'link', {'name': name})
    root.append(before)


def _remove(element: Element, *tags: str) -> None:
    for old in [each for tag in tags for each in element.findall(tag)]:
        element.remove(old)
