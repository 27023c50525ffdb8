# SPDX-License-Identifier: Apache-2.0
"""A payload on the hand whose place there nobody knows, as an effect of one's own."""

from leo_sim.description.robot import Robot
from leo_sim.effects import Effect, Parameter
from leo_sim.effects.base import Body, Values


class Payload(Effect):
    """A point mass m at (x, y, z) in the axes of the hand."""

    name = 'payload'
    family = 'inertia'
    hook = 'body'
    parameters = (
        Parameter('m', 'kg', low=0.0, role='amplitude'),
        *(Parameter(axis, 'm', low=-0.2, high=0.2, times='m', role='position') for axis in 'xyz'),
    )
    looks_like = 'A link is heavier, at a place of its own.'
    confused_with = 'link_mass, link_com'
    reveal = 'Slow motion of all joints over large angles.'

    def places(self, robot: Robot) -> tuple[str, ...]:
        """The hand alone."""
        return ('hand',)

    def body(self, p: Values, link: Body) -> Body:
        """The hand and the mass as one body."""
        added, point = p['m'], (p['x'], p['y'], p['z'])
        mass = link.mass + added
        way = [to - of for to, of in zip(point, link.com, strict=True)]
        com = tuple(of + added / mass * d for of, d in zip(link.com, way, strict=True))
        reduced, square = link.mass * added / mass, sum(d * d for d in way)
        x, y, z = way
        turning = *(square - d * d for d in way), -x * y, -x * z, -y * z
        inertia = tuple(i + reduced * t for i, t in zip(link.inertia, turning, strict=True))
        return link._replace(mass=mass, com=com, inertia=inertia)
