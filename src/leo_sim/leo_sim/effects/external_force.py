# SPDX-License-Identifier: Apache-2.0

from leo_sim.description.robot import Robot
from leo_sim.effects.base import Body, Effect, Parameter, Values
from leo_sim.effects.parameter import in_space


class ExternalForce(Effect):
    """A constant force (x, y, z) in world axes at the link's centre of mass.

    y only where a hinge turns the link about another axis.
    """

    name = 'external_force'
    family = 'load'
    hook = 'body'
    parameters = tuple(Parameter(axis, 'N', role='amplitude') for axis in 'xyz')
    equation = 'force (x, y, z) in world axes at the centre of mass'
    looks_like = 'As if gravity were stronger, weaker or turned, without any change of inertia.'
    confused_with = (
        'link_mass with link_inertia on one hinge; bias_torque and encoder_offset '
        'over narrow angles.'
    )
    reveal = 'Slow motion over a full turn, then fast motion: a force adds no inertia.'

    def body(self, p: Values, link: Body) -> Body:
        x, y, z = link.force
        return link._replace(force=(x + p['x'], y + p.get('y', 0.0), z + p['z']))

    def parameters_for(self, robot: Robot, where: tuple[str, ...]) -> tuple[Parameter, ...]:
        return in_space(robot, where, self.parameters, of_world=True)
