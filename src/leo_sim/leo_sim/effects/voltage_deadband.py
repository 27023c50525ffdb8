# SPDX-License-Identifier: Apache-2.0
"""Commands smaller than v do nothing, larger ones lose v."""

from __future__ import annotations

from typing import Any, TYPE_CHECKING

import numpy as np

from leo_sim.common.broadcasting import Numbers
from leo_sim.effects.base import Effect, in_input_unit, Parameter

if TYPE_CHECKING:
    from leo_sim.description.robot import Robot


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
    def law(v: Numbers, _: Numbers, __: Numbers, u: Numbers) -> Any:
        """Inputs that reach the motors."""
        return np.sign(u) * np.maximum(np.abs(u) - v, 0.0)

    def parameters_for(self, robot: Robot, where: tuple[str, ...]) -> tuple[Parameter, ...]:
        """Parameters in the unit of the robot's input."""
        return in_input_unit(robot, where, self.parameters)
