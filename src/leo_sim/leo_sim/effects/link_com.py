# SPDX-License-Identifier: Apache-2.0

from leo_sim.description.robot import Robot
from leo_sim.effects.base import Body, Effect, Parameter, Values
from leo_sim.effects.parameter import in_space


class LinkCom(Effect):
    """The centre of mass of a link moved by (x, y, z), mass and inertia about it kept.

    In the axes of the link; y only where a hinge turns the link about another axis.
    """

    name = 'link_com'
    family = 'inertia'
    hook = 'body'
    parameters = tuple(Parameter(axis, 'm', role='amplitude') for axis in 'xyz')
    equation = 'centre of mass + (x, y, z); mass and inertia about it kept'
    looks_like = 'Gravity pulls in a turned or longer direction.'
    confused_with = 'link_mass and external_force for z, encoder_offset and bias_torque for x.'
    reveal = 'Slow motion over a full turn.'

    def body(self, p: Values, link: Body) -> Body:
        x, y, z = link.com
        return link._replace(com=(x + p['x'], y + p.get('y', 0.0), z + p['z']))

    def parameters_for(self, robot: Robot, where: tuple[str, ...]) -> tuple[Parameter, ...]:
        return in_space(robot, where, self.parameters)
