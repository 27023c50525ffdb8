# SPDX-License-Identifier: Apache-2.0

from typing import Any

import numpy as np

from leo_sim.description.robot import Robot
from leo_sim.effects.base import Effect
from leo_sim.effects.parameter import in_input_unit, Parameter


class VoltagePush(Effect):
    """The drive adds v in the direction of every command, as firmware that makes up for friction.

    The opposite of a dead band.
    """

    name = 'voltage_push'
    family = 'command'
    hook = 'command'
    parameters = (Parameter('v', 'V', low=0.0, role='amplitude'),)
    equation = 'u_motor = u + v sign(u)'
    looks_like = 'Small commands do more than they should; large ones are stronger by a constant.'
    confused_with = (
        'voltage_scale at one amplitude; less dry friction than the model has, where '
        'commands go with the motion.'
    )
    reveal = 'Small and large commands, also against the motion.'
    rank = 35

    @staticmethod
    def law(v: float, _: float, __: float, u: float) -> Any:
        return u + v * np.sign(u)

    def parameters_for(self, robot: Robot, where: tuple[str, ...]) -> tuple[Parameter, ...]:
        return in_input_unit(robot, where, self.parameters)
