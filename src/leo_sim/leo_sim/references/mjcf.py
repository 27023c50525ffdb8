# SPDX-License-Identifier: Apache-2.0
"""A robot as MuJoCo's own description, MJCF, with the inertial figures of a model."""
from collections.abc import Mapping, Sequence
import math
from typing import Any
from xml.etree import ElementTree

from leo_sim.description.robot import Contact
from leo_sim.description.urdf import Body, Joint

KINDS = {'revolute': 'hinge', 'continuous': 'hinge', 'prismatic': 'slide'}
GROUND = 'the ground'
LEAST = 1e-12
"""Moments of inertia of point masses, kg m2: MuJoCo takes no zero."""


def mjcf(joints: Sequence[Joint], bodies: Mapping[str, Body], contacts: Sequence[Contact],
         gravity: float, slope: float) -> str:
    """The description as XML; contacts are spheres that touch the ground alone."""
    root = ElementTree.Element('mujoco')
    _add(root, 'compiler', angle='radian', inertiafromgeom='false', autolimits='false')
    option = _add(root, 'option', gravity=_text((0.0, 0.0, -gravity)), cone='elliptic',
                  impratio='10', integrator='implicitfast', jacobian='dense')
    _add(option, 'flag', warmstart='disable', eulerdamp='enable')
    world = _add(root, 'worldbody')
    if contacts:
        up = (-math.sin(slope), 0.0, math.cos(slope))
        _add(world, 'geom', name=GROUND, type='plane', size='0 0 1', zaxis=_text(up))
    children = {joint.child for joint in joints}
    made = {joint.parent: world for joint in joints if joint.parent not in children}
    for joint in joints:
        made[joint.child] = _body(made[joint.parent], joint, bodies[joint.child])
    pairs = _add(root, 'contact')
    for contact in contacts:
        _add(made[contact.link], 'geom', name=contact.name, type='sphere', mass='0',
             size=repr(contact.radius), pos=_text((contact.x, 0.0, contact.z)), contype='0',
             conaffinity='0')
        _add(pairs, 'pair', geom1=GROUND, geom2=contact.name, condim='3')
    return ElementTree.tostring(root, encoding='unicode')


def _body(parent: ElementTree.Element, joint: Joint, body: Body) -> ElementTree.Element:
    r = joint.rotation
    element = _add(parent, 'body', name=joint.child, pos=_text(joint.translation),
                   xyaxes=_text((r[0], r[3], r[6], r[1], r[4], r[7])))
    if joint.kind != 'fixed':
        low, high = joint.limits
        stops = {'limited': 'true', 'range': _text((low, high))} if math.isfinite(low) else {}
        _add(element, 'joint', name=joint.name, type=KINDS[joint.kind], axis=_text(joint.axis),
             **stops)
    if body.mass:
        xx, yy, zz, *products = body.inertia
        figures = (*(max(moment, LEAST) for moment in (xx, yy, zz)), *products)
        _add(element, 'inertial', mass=repr(float(body.mass)), pos=_text(body.com),
             fullinertia=_text(figures))
    return element


def _add(parent: ElementTree.Element, tag: str, **attributes: str) -> ElementTree.Element:
    return ElementTree.SubElement(parent, tag, attributes)


def _text(vector: Sequence[Any]) -> str:
    return ' '.join(repr(float(component)) for component in vector)
