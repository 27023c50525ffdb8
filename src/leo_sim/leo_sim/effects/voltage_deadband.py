# SPDX-License-Identifier: Apache-2.0

from typing import Any

import numpy as np

from leo_sim.description.robot import Robot
from leo_sim.effects.base import Effect
from leo_sim.effects.parameter import in_input_unit, Parameter


class VoltageDeadband(Effect):
    """Commands smaller than v do nothing, larger ones lose v."""

    name = 'voltage_deadband'
    family = 'command'
    hook = 'command'
    parameters = (Parameter('v', 'V', low=0.0, role='threshold'),)
    equation = 'u_motor = sign(u) max(|u| - v, 0)'
    looks_like = 'Small commands have no effect; large ones are weaker by a constant.'
    confused_with = (
        'coulomb_friction where the joint hardly moves; voltage_scale at one amplitude.'
    )
    reveal = 'Small and large commands, also while the joint coasts.'
    rank = 30

    @staticmethod
    def law(v: float, _: float, __: float, u: float) -> Any:
        return np.sign(u) * np.maximum(np.abs(u) - v, 0.0)

    def parameters_for(self, robot: Robot, where: tuple[str, ...]) -> tuple[Parameter, ...]:
        return in_input_unit(robot, where, self.parameters)
