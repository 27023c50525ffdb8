# SPDX-License-Identifier: Apache-2.0
"""Effects on the inertial figures of links, and forces on them."""

from dataclasses import replace
from typing import Any, ClassVar

import numpy as np

from leo_sim.common.broadcasting import Numbers
from leo_sim.description.robot import Robot
from leo_sim.effects.base import Body, Effect, Parameter, Placed, Values

ASKEW = 1e-6  # rad between axes that are not parallel
HANGS = 0.4  # s


class _Link(Effect):
    family = 'inertia'
    hook = 'body'

    def in_words(self, p: Values, where: str, constants: Values) -> str:
        mass = constants.get(f'links.{where}.mass') if self.parameters[0].unit == 'kg' else None
        return '' if mass is None else f'added to {float(mass):.3g} kg'


class _InSpace(_Link):
    in_world_axes: ClassVar[bool] = False

    def parameters_for(self, robot: Robot, where: tuple[str, ...]) -> tuple[Parameter, ...]:
        """Y only where a hinge turns a link about another axis: else nothing shows of it."""
        for link in where:
            frame, axes = robot.turned_about[link]
            y = (0.0, 1.0, 0.0) if self.in_world_axes else frame[:, 1]
            if (np.abs(np.cross(axes, y)) > ASKEW).any():
                return self.parameters
        return tuple(p for p in self.parameters if p.name != 'y')


class LinkMass(_Link):
    """Mass m added at the link's centre of mass, inertia about it kept."""

    name = 'link_mass'
    parameters = (Parameter('m', 'kg', role='amplitude'),)
    equation = 'mass + m, at the centre of mass; inertia about it kept'
    looks_like = 'Gravity and inertia of a link both differ, in proportion.'
    confused_with = 'external_force with link_inertia on one hinge.'
    reveal = 'Fast and slow motion over large angles.'

    def body(self, p: Values, link: Body) -> Body:
        return link._replace(mass=link.mass + p['m'])


class LinkCom(_InSpace):
    """The centre of mass of a link moved by (x, y, z), mass and inertia about it kept.

    In the axes of the link; y only where a hinge turns the link about another axis.
    """

    name = 'link_com'
    parameters = tuple(Parameter(axis, 'm', role='amplitude') for axis in 'xyz')
    equation = 'centre of mass + (x, y, z); mass and inertia about it kept'
    looks_like = 'Gravity pulls in a turned or longer direction.'
    confused_with = 'link_mass and external_force for z, encoder_offset and bias_torque for x.'
    reveal = 'Slow motion over a full turn.'

    def body(self, p: Values, link: Body) -> Body:
        x, y, z = link.com
        return link._replace(com=(x + p['x'], y + p.get('y', 0.0), z + p['z']))


class LinkInertia(_Link):
    """Inertia I added about the link's centre of mass, mass kept."""

    name = 'link_inertia'
    parameters = (Parameter('I', 'kg m2', role='amplitude', linear=False),)
    equation = 'inertia about the centre of mass + I'
    looks_like = 'A link turns more slowly or faster, its weight is right.'
    confused_with = 'armature on a single hinge: the same.'
    reveal = 'Fast motion with known torques, and free swings.'

    def body(self, p: Values, link: Body) -> Body:
        xx, yy, zz, *products = link.inertia
        return link._replace(inertia=(xx + p['I'], yy + p['I'], zz + p['I'], *products))


class Payload(_InSpace):
    """A point mass m at (x, y, z) of a link, in its axes: what a gripper holds, a tool.

    One cause of a heavier link, a moved centre of mass and more inertia about two axes.
    """

    name = 'payload'
    parameters = (
        Parameter('m', 'kg', low=0.0, role='amplitude'),
        *(Parameter(axis, 'm', times='m', role='position') for axis in 'xyz'),
    )
    together: ClassVar[tuple[str, ...]] = ('link_mass', 'link_com')
    equation = 'the link and a point mass m at (x, y, z), as one body'
    looks_like = 'A link is heavier, at a place of its own.'
    confused_with = 'link_mass with link_com: another inertia; the same of a link beyond it.'
    reveal = 'Slow and fast motion of several joints over large angles.'

    def body(self, p: Values, link: Body) -> Body:
        added, point = p['m'], (p['x'], p.get('y', link.com[1]), p['z'])
        mass = link.mass + added
        x, y, z = way = tuple(to - of for to, of in zip(point, link.com, strict=True))
        com = tuple(of + added / mass * d for of, d in zip(link.com, way, strict=True))
        turned = (y * y + z * z, x * x + z * z, x * x + y * y, -x * y, -x * z, -y * z)
        reduced = link.mass * added / mass
        inertia = tuple(i + reduced * t for i, t in zip(link.inertia, turned, strict=True))
        return link._replace(mass=mass, com=com, inertia=inertia)


class LatePayload(Payload):
    """A payload that is hung on about the time t0 of a run: from 8 to 92 % within a second."""

    name = 'late_payload'
    family = 'load'
    parameters = (*Payload.parameters, Parameter('t0', 's', low=0.0, role='shape'))
    together = ()
    equation = (
        'a payload at (x, y, z) of m (1 + tanh((t - t0) / 0.4)) / 2, t from the start of a run'
    )
    looks_like = 'From one moment on a link is heavier; all was right before.'
    confused_with = 'payload, where it was there nearly all along; torque_fade, warming_friction.'
    reveal = 'Motion over large angles for some seconds before and after.'
    onset = True

    def at(self, placed: Placed, time: Numbers) -> Placed:
        p = placed.parameters
        there = np.round(0.5 + 0.5 * np.tanh((time - p['t0']) / HANGS), 4)
        return replace(placed, effect=Payload(), parameters={**p, 'm': there * p['m']})

    def places(self, robot: Robot) -> tuple[str, ...]:
        """Not of a walker, whose runs take seconds."""
        return () if robot.contacts else super().places(robot)


class ExternalForce(_InSpace):
    """A constant force (x, y, z) in world axes at the link's centre of mass."""

    name = 'external_force'
    family = 'load'
    in_world_axes = True
    parameters = tuple(Parameter(axis, 'N', role='amplitude') for axis in 'xyz')
    equation = 'force (x, y, z) in world axes at the centre of mass'
    looks_like = 'As if gravity were stronger, weaker or turned, without any change of inertia.'
    confused_with = 'link_mass with link_inertia on one hinge; bias_torque over narrow angles.'
    reveal = 'Slow motion over a full turn, then fast motion: a force adds no inertia.'

    def body(self, p: Values, link: Body) -> Body:
        return _pulled(link, p, 1.0)


class Gravity(_InSpace):
    """Gravity changed by (x, y, z) in world axes, of all links: a robot that is mounted askew.

    y only where a hinge turns a link about another axis. Nothing of a robot with one joint, where
    it is an external force, or on the ground, where it is a slope.
    """

    name = 'gravity'
    family = 'load'
    in_world_axes = True
    undivided = True
    parameters = tuple(Parameter(axis, 'm/s2', role='amplitude') for axis in 'xyz')
    equation = 'gravity + (x, y, z) in world axes, on every link'
    looks_like = 'Every link is pulled another way, or more or less, in proportion to its mass.'
    confused_with = 'encoder_offset of a level hinge that carries all: the same; external_force.'
    reveal = 'Slow motion of all joints over large angles.'
    rank = 110

    def body(self, p: Values, link: Body) -> Body:
        return _pulled(link, p, link.mass)

    def in_words(self, p: Values, where: str, constants: Values) -> str:
        x, y, down = p['x'], p.get('y', 0.0), constants['gravity'] - p['z']
        turned, heading = np.degrees([np.arctan2(np.hypot(x, y), down), np.arctan2(y, x)])
        way = f'{heading:.0f} degrees (x: 0, y: 90)' if 'y' in p else 'x' if x > 0 else '-x'
        size = np.linalg.norm([x, y, down])
        return f'which is gravity of {size:.3g} m/s2, turned by {turned:.3g} degrees towards {way}'

    def places(self, robot: Robot) -> tuple[str, ...]:
        return () if robot.contacts or len(robot.joint_names) == 1 else super().places(robot)


def _pulled(link: Body, p: Values, by: Any) -> Body:
    x, y, z = link.force
    return link._replace(force=(x + by * p['x'], y + by * p.get('y', 0.0), z + by * p['z']))
