# SPDX-License-Identifier: Apache-2.0

from typing import Any

from leo_sim.effects.base import Effect, Parameter


class JointSpring(Effect):
    """A linear spring at the joint: -k (q - rest)."""

    name = 'joint_spring'
    family = 'load'
    hook = 'torque'
    parameters = (
        Parameter('k', 'N m/rad', low=0.0, role='amplitude'),
        Parameter('rest', 'rad', times='k', role='position'),
    )
    equation = 'tau = -k (q - rest)'
    looks_like = (
        'A pull towards one angle that grows with the distance from it: cables, hoses, springs.'
    )
    confused_with = 'link_mass and external_force in small swings about the hanging pose.'
    reveal = 'Large angles, several turns if the robot can.'

    @staticmethod
    def law(
        k: float, rest: float, _a: float, q: float, dq: float, motor: float, load: float
    ) -> Any:
        return -k * (q - rest)
