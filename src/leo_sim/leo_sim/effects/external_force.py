# SPDX-License-Identifier: Apache-2.0

from leo_sim.effects.base import Body, Effect, Parameter, Values


class ExternalForce(Effect):
    """A constant force (x, z) in world axes at the link's centre of mass."""

    name = 'external_force'
    family = 'load'
    hook = 'body'
    parameters = (Parameter('x', 'N', role='amplitude'), Parameter('z', 'N', role='amplitude'))
    equation = 'force (x, z) in world axes at the centre of mass'
    looks_like = 'As if gravity were stronger, weaker or turned, without any change of inertia.'
    confused_with = (
        'link_mass with link_inertia on one hinge; bias_torque and encoder_offset '
        'over narrow angles.'
    )
    reveal = 'Slow motion over a full turn, then fast motion: a force adds no inertia.'

    def body(self, p: Values, link: Body) -> Body:
        x, y, z = link.force
        return link._replace(force=(x + p['x'], y, z + p['z']))
