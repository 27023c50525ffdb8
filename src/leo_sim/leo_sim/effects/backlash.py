# SPDX-License-Identifier: Apache-2.0

from leo_sim.description.robot import Robot
from leo_sim.effects.base import Drive, Effect, Parameter, Values


class Backlash(Effect):
    """Play in the gear: the motor inertia moves freely within a dead zone, encoder on the link."""

    name = 'backlash'
    family = 'gear'
    hook = 'drive'
    parameters = (Parameter('gap', 'rad', low=0.0, role='threshold'),)
    equation = 'the motor turns the link only where |q_motor - q| = gap / 2'
    looks_like = (
        'For an instant after each reversal of torque the link moves without its '
        'motor, then a jolt.'
    )
    confused_with = 'voltage_deadband and coulomb_friction near reversals; command_delay.'
    reveal = 'Frequent reversals of small torques about the hanging pose.'

    def drive(self, p: Values, drive: Drive) -> Drive:
        return drive._replace(gap=drive.gap + p['gap'])

    def places(self, robot: Robot) -> tuple[str, ...]:
        return tuple(a.joint for a in robot.actuators if a.rotor_inertia > 0)
