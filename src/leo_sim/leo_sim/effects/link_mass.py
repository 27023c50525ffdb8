# SPDX-License-Identifier: Apache-2.0

from leo_sim.effects.base import Body, Effect, Parameter, Values


class LinkMass(Effect):
    """Mass m added at the link's centre of mass, inertia about it kept."""

    name = 'link_mass'
    family = 'inertia'
    hook = 'body'
    parameters = (Parameter('m', 'kg', role='amplitude'),)
    equation = 'mass + m, at the centre of mass; inertia about it kept'
    looks_like = 'Gravity and inertia of a link both differ, in proportion.'
    confused_with = 'external_force with link_inertia on one hinge.'
    reveal = 'Fast and slow motion over large angles.'

    def body(self, p: Values, link: Body) -> Body:
        return link._replace(mass=link.mass + p['m'])
