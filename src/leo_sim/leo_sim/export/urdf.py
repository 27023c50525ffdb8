# SPDX-License-Identifier: Apache-2.0
"""A model as URDF: inertial figures, viscous and dry friction, largest torque and speed."""

from xml.etree import ElementTree

import numpy as np

from leo_sim.description.urdf import put_bodies
from leo_sim.export.figures import Figures, figures
from leo_sim.model.model import Model


def urdf(model: Model) -> ElementTree.Element:
    """A model whose laws URDF holds (see `held`), shapes as in its robot's own URDF.

    Raises:
        UserError: Inertial figures that no body has.
    """
    root, found = ElementTree.fromstring(model.robot.urdf), figures(model)
    put_bodies(root, {name: b for name, b in found.laws.bodies.items() if b.mass})
    for joint in root.findall('joint'):
        for old in joint.findall('dynamics'):
            joint.remove(old)
        if joint.get('name') in model.robot.joint_names:
            i = model.robot.joint_names.index(joint.get('name', ''))
            if found.damping[i] or found.friction[i]:
                ElementTree.SubElement(
                    joint,
                    'dynamics',
                    {
                        'damping': repr(float(found.damping[i])),
                        'friction': repr(float(found.friction[i])),
                    },
                )
    _limits(root, model, found)
    return root


def _limits(root: ElementTree.Element, model: Model, found: Figures) -> None:
    """Torque at rest and speed without load of motors; of torque inputs the largest one."""
    robot, drive = model.robot, found.drives
    joints = {joint.get('name'): joint for joint in root.findall('joint')}
    for i, actuator in enumerate(robot.actuators):
        most = actuator.strongest if robot.input == 'position' else actuator.limit
        figures_of = {'effort': drive.gain[i] * np.minimum(most, drive.most[i])}
        if robot.has_motor_law:
            figures_of['velocity'] = figures_of['effort'] / drive.back_emf[i]
        joint = joints[actuator.joint]
        limit = joint.find('limit')
        if limit is None and robot.has_motor_law:
            limit = ElementTree.SubElement(joint, 'limit')
        if limit is not None:
            for key, value in figures_of.items():
                limit.set(key, repr(float(value)))
