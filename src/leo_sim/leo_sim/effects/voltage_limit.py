# SPDX-License-Identifier: Apache-2.0

from dataclasses import replace
from typing import Any

import numpy as np

from leo_sim.description.robot import Robot
from leo_sim.effects.base import Effect
from leo_sim.effects.parameter import in_input_unit, Parameter


class VoltageLimit(Effect):
    """Commands are clipped to +-v."""

    name = 'voltage_limit'
    family = 'command'
    hook = 'command'
    parameters = (Parameter('v', 'V', neutral=float('inf'), low=0.0, role='threshold'),)
    equation = 'u_motor = min(max(u, -v), v)'
    looks_like = 'Right with small commands, too weak with large ones.'
    confused_with = 'voltage_scale when only large commands occur.'
    reveal = 'Commands from small to the largest allowed.'
    rank = 40

    @staticmethod
    def law(v: float, _: float, __: float, u: float) -> Any:
        return np.minimum(np.maximum(u, -v), v)

    def parameters_for(self, robot: Robot, where: tuple[str, ...]) -> tuple[Parameter, ...]:
        most = max(a.strongest for a in robot.actuators if a.joint in where)
        return tuple(
            replace(p, neutral=most) for p in in_input_unit(robot, where, self.parameters)
        )
