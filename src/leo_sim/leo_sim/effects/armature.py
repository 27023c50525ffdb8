# SPDX-License-Identifier: Apache-2.0

from leo_sim.effects.base import Drive, Effect, Parameter, Values


class Armature(Effect):
    """Inertia J added to the motor side of the joint."""

    name = 'armature'
    family = 'inertia'
    hook = 'drive'
    parameters = (Parameter('J', 'kg m2', low=0.0, role='amplitude', linear=False),)
    equation = 'J dw/dt more torque is needed at the joint'
    looks_like = 'The joint answers more slowly to torque, weight unchanged.'
    confused_with = (
        'link_inertia on a single hinge: the same; command_delay and torque_scale in short runs.'
    )
    reveal = 'Free swings: the period grows while the weight stays.'

    def drive(self, p: Values, drive: Drive) -> Drive:
        return drive._replace(rotor_inertia=drive.rotor_inertia + p['J'])
