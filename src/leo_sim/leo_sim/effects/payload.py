# SPDX-License-Identifier: Apache-2.0

from leo_sim.description.robot import Robot
from leo_sim.effects.base import Body, Effect, Parameter, Values
from leo_sim.effects.parameter import in_space


class Payload(Effect):
    """A point mass m at (x, y, z) of a link, in its axes: what a gripper holds, a tool.

    One cause of a heavier link, a moved centre of mass and more inertia about two axes.
    """

    name = 'payload'
    family = 'inertia'
    hook = 'body'
    parameters = (
        Parameter('m', 'kg', low=0.0, role='amplitude'),
        *(Parameter(axis, 'm', times='m', role='position') for axis in 'xyz'),
    )
    together = ('link_mass', 'link_com')
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

    def parameters_for(self, robot: Robot, where: tuple[str, ...]) -> tuple[Parameter, ...]:
        return in_space(robot, where, self.parameters)
