# SPDX-License-Identifier: Apache-2.0
"""The slope of the ground, positive uphill in +x."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING

from leo_sim.effects.base import Effect, Ground, Parameter, Values

if TYPE_CHECKING:
    from leo_sim.description.robot import Robot


class GroundSlope(Effect):
    """The slope of the ground, positive uphill in +x."""

    name = 'ground_slope'
    family = 'ground'
    hook = 'ground'
    parameters = (Parameter('angle', 'rad', low=-0.5, high=0.5, role='amplitude'),)
    equation = 'height of the floor = x tan(angle)'
    looks_like = 'Feet touch earlier ahead and later behind; standing leans with the slope.'
    confused_with = 'encoder_offset of the ankles near one spot; external_force x of the torso.'
    reveal = 'Walk along x: the height of the base over the floor grows with the distance.'

    def ground(self, p: Values, ground: Ground) -> Ground:
        """The ground, changed."""
        return ground._replace(slope=p['angle'])

    def parameters_for(self, robot: Robot, where: tuple[str, ...]) -> tuple[Parameter, ...]:
        """Neutral is the ground of the robot."""
        return tuple(
            replace(p, neutral=robot.constants[f'ground.{figure}'].value)
            for p, figure in zip(self.parameters, ('slope',), strict=True)
        )
