# SPDX-License-Identifier: Apache-2.0

from leo_sim.effects.base import Effect, Ground, Parameter, Values


class GroundSlope(Effect):
    """The slope of the ground, positive uphill in +x."""

    name = 'ground_slope'
    family = 'ground'
    hook = 'ground'
    parameters = (
        Parameter('angle', 'rad', low=-0.5, high=0.5, role='amplitude', constant='ground.slope'),
    )
    equation = 'height of the floor = x tan(angle)'
    looks_like = 'Feet touch earlier ahead and later behind; standing leans with the slope.'
    confused_with = 'encoder_offset of the ankles near one spot; external_force x of the torso.'
    reveal = 'Walk along x: the height of the base over the floor grows with the distance.'

    def ground(self, p: Values, ground: Ground) -> Ground:
        return ground._replace(slope=p['angle'])
