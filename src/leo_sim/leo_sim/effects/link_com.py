# SPDX-License-Identifier: Apache-2.0

from leo_sim.effects.base import Body, Effect, Parameter, Values


class LinkCom(Effect):
    """The centre of mass of a link moved by (x, z), mass and inertia about it kept."""

    name = 'link_com'
    family = 'inertia'
    hook = 'body'
    parameters = (Parameter('x', 'm', role='amplitude'), Parameter('z', 'm', role='amplitude'))
    equation = 'centre of mass + (x, z); mass and inertia about it kept'
    looks_like = 'Gravity pulls in a turned or longer direction.'
    confused_with = 'link_mass and external_force for z, encoder_offset and bias_torque for x.'
    reveal = 'Slow motion over a full turn.'

    def body(self, p: Values, link: Body) -> Body:
        x, y, z = link.com
        return link._replace(com=(x + p['x'], y, z + p['z']))
