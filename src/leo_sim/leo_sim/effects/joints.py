# SPDX-License-Identifier: Apache-2.0
"""Effects at a joint beside friction: of its motor, its gear, and constant torques and springs."""

from dataclasses import replace
from typing import Any

import numpy as np

from leo_sim.common.broadcasting import Array, Numbers
from leo_sim.description.robot import Robot
from leo_sim.effects.base import Drive, Effect, Parameter, Values
from leo_sim.effects.motor import Motor


class TorqueScale(Effect):
    """The net motor torque is k times the model's, back-EMF included."""

    name = 'torque_scale'
    family = 'motor'
    hook = 'torque'
    parameters = (Parameter('k', '', neutral=1.0, low=0.0, role='amplitude'),)
    equation = 'tau = (k - 1) tau_motor, back-EMF included'
    looks_like = 'Everything the motor does, pushing and braking, is stronger or weaker.'
    confused_with = 'voltage_scale (the same if torques are commanded or the constant refitted).'
    reveal = 'Runs at 0 V: braking changes with torque_scale, not with voltage_scale.'
    motor_side = True
    steady = True
    rank = 20

    def torque(self, p: Values, q: Array, dq: Array, motor: Motor, load: Numbers | None) -> Any:
        return (p['k'] - 1.0) * motor.torque


class BackEmfScale(Effect):
    """Back-EMF is k times the model's."""

    name = 'back_emf_scale'
    family = 'motor'
    hook = 'torque'
    parameters = (Parameter('k', '', neutral=1.0, low=0.0, role='amplitude'),)
    equation = 'tau = (k - 1) tau_emf'
    looks_like = 'Damping while the motors are on differs; the stall torque is right.'
    confused_with = 'viscous_friction of a motor on a voltage that is never free: the same.'
    reveal = 'Let it swing with the motors free: only friction is left then.'
    motor_side = True
    steady = True
    rank = 10

    def torque(self, p: Values, q: Array, dq: Array, motor: Motor, load: Numbers | None) -> Any:
        return (p['k'] - 1.0) * motor.back_emf

    def places(self, robot: Robot) -> tuple[str, ...]:
        return super().places(robot) if robot.has_motor_law else ()


class TorqueRipple(Effect):
    """Torque ripple: a sin(n q + phase), cogging of motor or gear."""

    name = 'torque_ripple'
    family = 'motor'
    hook = 'torque'
    parameters = (
        Parameter('a', 'N m', low=0.0, role='amplitude'),
        Parameter('n', '1/turn', low=0.0, whole=True, role='shape'),
        Parameter('phase', 'rad', role='phase'),
    )
    equation = 'tau = a sin(n q + phase)'
    looks_like = 'A missing torque that repeats n times per turn, whatever the speed.'
    confused_with = 'link_mass and external_force for n = 1; encoder_scale.'
    reveal = 'Slow motion over full turns, both ways.'

    @staticmethod
    def law(a: float, n: float, phi: float, q: float, dq: float, motor: float, load: float) -> Any:
        return a * np.sin(n * q + phi)


class BiasTorque(Effect):
    """A constant torque t."""

    name = 'bias_torque'
    family = 'load'
    hook = 'torque'
    parameters = (Parameter('t', 'N m', role='amplitude'),)
    equation = 'tau = t'
    looks_like = 'One direction is easier than the other at every angle.'
    confused_with = 'encoder_offset and external_force while the angle stays in a narrow range.'
    reveal = 'Slow motion over the full turn: a bias stays constant, gravity terms change sign.'
    steady = True

    def torque(self, p: Values, q: Array, dq: Array, motor: Motor, load: Numbers | None) -> Any:
        return p['t'] + 0.0 * q


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
    looks_like = 'A pull towards one angle that grows with the distance from it: cables, hoses.'
    confused_with = 'link_mass and external_force in small swings about the hanging pose.'
    reveal = 'Large angles, several turns if the robot can.'

    @staticmethod
    def law(k: float, q0: float, _: float, q: float, dq: float, motor: float, load: float) -> Any:
        return -k * (q - q0)


class Backlash(Effect):
    """Play in the gear: the motor inertia moves freely within a dead zone, encoder on the link."""

    name = 'backlash'
    family = 'gear'
    hook = 'drive'
    parameters = (Parameter('gap', 'rad', low=0.0, role='threshold'),)
    equation = 'the motor turns the link only where |q_motor - q| = gap / 2'
    looks_like = 'After each reversal of torque the link moves without its motor, then a jolt.'
    confused_with = 'voltage_deadband and coulomb_friction near reversals; command_delay.'
    reveal = 'Frequent reversals of small torques about the hanging pose.'

    def drive(self, p: Values, drive: Drive) -> Drive:
        return drive._replace(gap=drive.gap + p['gap'])

    def places(self, robot: Robot) -> tuple[str, ...]:
        return tuple(a.joint for a in robot.actuators if a.rotor_inertia > 0)


class SupplySag(Effect):
    """The supply of all motors has a resistance R: what one draws is missing at the others too.

    A bridge of duty u / V draws duty x I, or gives it back. Never tried on walkers, nor theirs.
    """

    name = 'supply_sag'
    family = 'motor'
    hook = 'drive'
    parameters = (Parameter('R', 'ohm', low=0.0, role='amplitude'),)
    equation = 'V_motor = duty (V - R sum(duty I)), over all motors'
    looks_like = 'Each motor is weaker the more all of them pull, at the largest commands most.'
    confused_with = 'voltage_limit and voltage_scale of one motor; torque_fade.'
    reveal = 'Large and small commands, of one motor and of all at once.'
    undivided = True

    def drive(self, p: Values, drive: Drive) -> Drive:
        return drive._replace(source=drive.source + p['R'])

    def places(self, robot: Robot) -> tuple[str, ...]:
        return () if robot.contacts or not robot.has_motor_law else super().places(robot)

    def parameters_for(self, robot: Robot, where: tuple[str, ...]) -> tuple[Parameter, ...]:
        """At most the resistance of a motor, which then gets half of the supply."""
        most = max(a.resistance or 0.0 for a in robot.actuators)
        return (replace(self.parameters[0], high=most),)


class Armature(Effect):
    """Inertia J added to the motor side of the joint."""

    name = 'armature'
    family = 'inertia'
    hook = 'drive'
    parameters = (Parameter('J', 'kg m2', low=0.0, role='amplitude', linear=False),)
    equation = 'J dw/dt more torque is needed at the joint'
    looks_like = 'The joint answers more slowly to torque, weight unchanged.'
    confused_with = 'link_inertia on a single hinge: the same; command_delay in short runs.'
    reveal = 'Free swings: the period grows while the weight stays.'

    def drive(self, p: Values, drive: Drive) -> Drive:
        return drive._replace(rotor_inertia=drive.rotor_inertia + p['J'])
