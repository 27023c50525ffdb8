# SPDX-License-Identifier: Apache-2.0
"""Effects of the ground."""

from leo_sim.effects.base import Effect, Ground, Parameter, Values


class _OfGround(Effect):
    family = hook = 'ground'


class GroundFriction(_OfGround):
    """The friction coefficient between the feet and the ground."""

    name = 'ground_friction'
    parameters = (
        Parameter('mu', '', low=0.0, role='amplitude', linear=False, constant='ground.friction'),
    )
    equation = '|f_tangential| <= mu f_normal'
    looks_like = 'Stance feet slide where the model holds them; nothing changes in the air.'
    confused_with = 'ground_slope, which also drives sliding, downhill only.'
    reveal = 'Push hard with one foot on the ground: fast hip strokes while standing.'

    def ground(self, p: Values, ground: Ground) -> Ground:
        return ground._replace(friction=p['mu'])


class GroundCompliance(_OfGround):
    """Stiffness and damping of the ground under each contact."""

    name = 'ground_compliance'
    parameters = (
        Parameter(
            'k', 'N/m', low=0.0, role='amplitude', linear=False, constant='ground.stiffness'
        ),
        Parameter('d', 'N s/m', low=0.0, role='shape', constant='ground.damping'),
    )
    equation = 'f_normal = k depth + d d(depth)/dt, never pulling'
    looks_like = 'Feet sink deeper or bounce: other base heights, and rates after footfalls.'
    confused_with = 'link_mass, which also lowers the stance height; ground_slope over one spot.'
    reveal = 'Footfalls of different speed, and standing still on one and on two feet.'

    def ground(self, p: Values, ground: Ground) -> Ground:
        return ground._replace(stiffness=p['k'], damping=p['d'])


class GroundSlope(_OfGround):
    """The slope of the ground, positive uphill in +x."""

    name = 'ground_slope'
    parameters = (
        Parameter('angle', 'rad', low=-0.5, high=0.5, role='amplitude', constant='ground.slope'),
    )
    equation = 'height of the floor = x tan(angle)'
    looks_like = 'Feet touch earlier ahead and later behind; standing leans with the slope.'
    confused_with = 'encoder_offset of the ankles near one spot; external_force x of the torso.'
    reveal = 'Walk along x: the height of the base over the floor grows with the distance.'

    def ground(self, p: Values, ground: Ground) -> Ground:
        return ground._replace(slope=p['angle'])
