# SPDX-License-Identifier: Apache-2.0

from leo_sim.effects.base import Effect, Ground, Parameter, Values


class GroundCompliance(Effect):
    """Stiffness and damping of the ground under each contact."""

    name = 'ground_compliance'
    family = 'ground'
    hook = 'ground'
    parameters = (
        Parameter(
            'k', 'N/m', low=0.0, role='amplitude', linear=False, constant='ground.stiffness'
        ),
        Parameter('d', 'N s/m', low=0.0, role='shape', constant='ground.damping'),
    )
    equation = 'f_normal = k depth + d d(depth)/dt, never pulling'
    looks_like = (
        'Feet sink deeper or bounce: base height in stance, and rates after each footfall, differ.'
    )
    confused_with = 'link_mass, which also lowers the stance height; ground_slope over one spot.'
    reveal = 'Footfalls of different speed, and standing still on one and on two feet.'

    def ground(self, p: Values, ground: Ground) -> Ground:
        return ground._replace(stiffness=p['k'], damping=p['d'])
