# SPDX-License-Identifier: Apache-2.0
"""The friction coefficient between the feet and the ground."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING

from leo_sim.effects.base import Effect, Ground, Parameter, Values

if TYPE_CHECKING:
    from leo_sim.description.robot import Robot


class GroundFriction(Effect):
    """The friction coefficient between the feet and the ground."""

    name = 'ground_friction'
    family = 'ground'
    hook = 'ground'
    parameters = (Parameter('mu', '', low=0.0, role='amplitude', linear=False),)
    equation = '|f_tangential| <= mu f_normal'
    looks_like = 'Stance feet slide where the model holds them; nothing changes in the air.'
    confused_with = 'ground_slope, which also drives sliding, downhill only.'
    reveal = 'Push hard with one foot on the ground: fast hip strokes while standing.'

    def ground(self, p: Values, ground: Ground) -> Ground:
        """The ground, changed."""
        return ground._replace(friction=p['mu'])

    def parameters_for(self, robot: Robot, where: tuple[str, ...]) -> tuple[Parameter, ...]:
        """Neutral is the ground of the robot."""
        return tuple(
            replace(p, neutral=robot.constants[f'ground.{figure}'].value)
            for p, figure in zip(self.parameters, ('friction',), strict=True)
        )
