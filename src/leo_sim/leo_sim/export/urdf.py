# SPDX-License-Identifier: Apache-2.0
"""A model as URDF: masses, damping, dry friction, and how strong its motors are."""

from xml.etree.ElementTree import Element, fromstring, SubElement

from leo_sim.description.urdf import put_bodies
from leo_sim.export.figures import Figures, figures, strengths
from leo_sim.model.model import Model


def urdf(model: Model, dynamics: bool = True) -> Element:
    """A model whose laws URDF holds (see `held`), shapes as in its robot's own URDF.

    Without `dynamics` its joints have no friction: what imports the file says that elsewhere.
    """
    root, found = fromstring(model.robot.urdf), figures(model)
    put_bodies(root, {name: b for name, b in found.laws.bodies.items() if b.mass})
    for joint in root.findall('joint'):
        for old in joint.findall('dynamics'):
            joint.remove(old)
        if dynamics and joint.get('name') in model.robot.joint_names:
            i = model.robot.joint_names.index(joint.get('name', ''))
            damping, friction = float(found.damping[i]), float(found.friction[i])
            if damping or friction:
                SubElement(joint, 'dynamics', damping=repr(damping), friction=repr(friction))
    _limits(root, model, found)
    return root


def _limits(root: Element, model: Model, found: Figures) -> None:
    robot, drive = model.robot, found.drives
    joints = {joint.get('name'): joint for joint in root.findall('joint')}
    efforts = strengths(robot, found)
    for i, actuator in enumerate(robot.actuators):
        figures_of = {'effort': efforts[i]}
        if robot.has_motor_law and drive.back_emf[i]:
            figures_of['velocity'] = efforts[i] / drive.back_emf[i]
        joint = joints[actuator.joint]
        limit = joint.find('limit')
        if limit is None and robot.has_motor_law:
            limit = SubElement(joint, 'limit')
        if limit is not None:
            for key, value in figures_of.items():
                limit.set(key, repr(float(value)))
