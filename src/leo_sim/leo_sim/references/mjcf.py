# SPDX-License-Identifier: Apache-2.0
"""A robot as MuJoCo's own description, MJCF, with the inertial figures of a model."""

import math
from xml.etree.ElementTree import Element, SubElement, tostring

from leo_sim.description.robot import Robot
from leo_sim.description.urdf import Body, Joint, numbers
from leo_sim.laws.laws import Laws

KINDS = {'revolute': 'hinge', 'continuous': 'hinge', 'prismatic': 'slide'}
GROUND = 'the ground'
OPTION = {'cone': 'elliptic', 'impratio': '10', 'integrator': 'implicitfast', 'jacobian': 'dense'}
LEAST = 1e-12  # moments of inertia of point masses, kg m2: MuJoCo takes no zero
HARD, RETURN = 0.9999, 0.02
"""Stops: impedance, and the share of what a joint went too far that it goes back per substep."""


def written(root: Element) -> str:
    return tostring(root, encoding='unicode')


def hard_figures(h: float) -> tuple[tuple[float, float], tuple[float, ...]]:
    """Of hard stops and dry friction at substeps of h s: MuJoCo's solref and solimp."""
    return (-HARD * RETURN / h**2, -HARD / h), (HARD, HARD, 1.0, 0.5, 1.0)


def tree(robot: Robot, laws: Laws) -> Element:
    """The description; contacts are spheres that touch the ground alone."""
    root = Element('mujoco')
    SubElement(root, 'compiler', angle='radian', inertiafromgeom='false', autolimits='false')
    option = SubElement(root, 'option', {'gravity': numbers((0.0, 0.0, -laws.gravity))} | OPTION)
    SubElement(option, 'flag', warmstart='disable', eulerdamp='enable')
    world = SubElement(root, 'worldbody')
    if robot.contacts:
        slope = laws.ground.slope if laws.ground else 0.0
        up = (-math.sin(slope), 0.0, math.cos(slope))
        SubElement(world, 'geom', name=GROUND, type='plane', size='0 0 1', zaxis=numbers(up))
    children = {joint.child for joint in robot.joints}
    made = {joint.parent: world for joint in robot.joints if joint.parent not in children}
    for joint in robot.joints:
        made[joint.child] = _body(made[joint.parent], joint, laws.bodies[joint.child])
    pairs = SubElement(root, 'contact')
    for contact in robot.contacts:
        sphere = {
            'name': contact.name,
            'type': 'sphere',
            'mass': '0',
            'size': repr(contact.radius),
            'pos': numbers((contact.x, 0.0, contact.z)),
            'contype': '0',
            'conaffinity': '0',
        }
        SubElement(made[contact.link], 'geom', sphere)
        SubElement(pairs, 'pair', geom1=GROUND, geom2=contact.name, condim='3')
    return root


def _body(parent: Element, joint: Joint, body: Body) -> Element:
    r, place = joint.rotation, numbers(joint.translation)
    axes = numbers((r[0], r[3], r[6], r[1], r[4], r[7]))
    element = SubElement(parent, 'body', name=joint.child, pos=place, xyaxes=axes)
    if joint.kind != 'fixed':
        moving = SubElement(element, 'joint', name=joint.name, type=KINDS[joint.kind])
        moving.set('axis', numbers(joint.axis))
        if math.isfinite(joint.limits[0]):
            moving.set('limited', 'true')
            moving.set('range', numbers(joint.limits))
    if body.mass:
        xx, yy, zz, *products = body.inertia
        figures = (*(max(moment, LEAST) for moment in (xx, yy, zz)), *products)
        mass, com = repr(float(body.mass)), numbers(body.com)
        SubElement(element, 'inertial', mass=mass, pos=com, fullinertia=numbers(figures))
    return element
