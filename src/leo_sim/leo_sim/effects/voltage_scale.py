# SPDX-License-Identifier: Apache-2.0

from typing import Any

from leo_sim.effects.base import Effect, Parameter


class VoltageScale(Effect):
    """The motor gets k times the command."""

    name = 'voltage_scale'
    family = 'command'
    hook = 'command'
    parameters = (Parameter('k', '', neutral=1.0, low=0.0, role='amplitude'),)
    equation = 'u_motor = k u'
    looks_like = 'Commands are stronger or weaker than sent; braking at 0 V is right.'
    confused_with = (
        'torque_scale (the same on a torque-driven joint, or where the torque '
        'constant is refitted).'
    )
    reveal = 'Runs at 0 V besides driven ones.'
    rank = 20

    @staticmethod
    def law(k: float, _: float, __: float, u: float) -> Any:
        return k * u
