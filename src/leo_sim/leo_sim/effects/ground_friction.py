# SPDX-License-Identifier: Apache-2.0

from leo_sim.effects.base import Effect, Ground, Parameter, Values


class GroundFriction(Effect):
    """The friction coefficient between the feet and the ground."""

    name = 'ground_friction'
    family = 'ground'
    hook = 'ground'
    parameters = (
        Parameter('mu', '', low=0.0, role='amplitude', linear=False, constant='ground.friction'),
    )
    equation = '|f_tangential| <= mu f_normal'
    looks_like = 'Stance feet slide where the model holds them; nothing changes in the air.'
    confused_with = 'ground_slope, which also drives sliding, downhill only.'
    reveal = 'Push hard with one foot on the ground: fast hip strokes while standing.'

    def ground(self, p: Values, ground: Ground) -> Ground:
        return ground._replace(friction=p['mu'])
