# SPDX-License-Identifier: Apache-2.0
"""Friction of a joint: viscous, dry, under load."""

from typing import Any

import numpy as np

from leo_sim.common.broadcasting import Array, Numbers
from leo_sim.description.robot import Robot
from leo_sim.effects.base import Effect, Parameter, Values
from leo_sim.effects.motor import Motor

NOTHING = 1e-9
"""rad/s, W: rounding leaves some 1e-17 of a joint that friction holds, of either sign."""


class _Friction(Effect):
    family = 'friction'
    hook = 'torque'


class _DryUnderLoad(_Friction):
    dry = True
    uses_load = True


class ViscousFriction(_Friction):
    """Viscous friction: a torque -b w against the joint speed."""

    name = 'viscous_friction'
    parameters = (Parameter('b', 'N m s/rad', low=0.0, role='amplitude'),)
    equation = 'tau = -b w'
    looks_like = 'Motion dies out too fast, in proportion to speed; nothing at rest.'
    confused_with = 'back_emf_scale on a voltage-driven joint that is never free: the same torque.'
    reveal = 'Let it swing with the motors free: back-EMF is gone then, viscous friction is not.'
    steady = True

    def torque(self, p: Values, q: Array, dq: Array, motor: Motor, load: Numbers | None) -> Any:
        return -p['b'] * dq


class QuadraticDrag(_Friction):
    """Quadratic drag: a torque -d w |w|, as of air."""

    name = 'quadratic_drag'
    parameters = (Parameter('d', 'N m s2/rad2', low=0.0, role='amplitude'),)
    equation = 'tau = -d w |w|'
    looks_like = 'Little loss in slow motion, strong loss at the highest speeds.'
    confused_with = 'viscous_friction and back_emf_scale when the speed range is narrow.'
    reveal = 'Free swings from large and from small angles.'

    @staticmethod
    def law(d: float, _a: float, _b: float, q: float, dq: float, motor: float, load: float) -> Any:
        return -d * dq * np.abs(dq)


class CoulombFriction(_Friction):
    """Coulomb friction: a constant torque c against motion, holding still below c."""

    name = 'coulomb_friction'
    parameters = (Parameter('c', 'N m', low=0.0, role='amplitude', linear=False),)
    equation = 'tau = -c sign(w); holds still while the other torques stay below c'
    looks_like = 'Swings shrink by the same amount each; small torques start no motion.'
    confused_with = 'voltage_deadband of what hardly moves; viscous_friction at one speed.'
    reveal = 'Slow triangles and free swings to rest: a step of the torque at zero speed.'
    dry = True
    steady = True

    def torque(self, p: Values, q: Array, dq: Array, motor: Motor, load: Numbers | None) -> Any:
        return -np.copysign(p['c'], dq)


class StribeckFriction(_Friction):
    """Stribeck friction: dry friction that is larger near rest."""

    name = 'stribeck_friction'
    parameters = (
        Parameter('c', 'N m', low=0.0, role='amplitude', linear=False),
        Parameter('c_static', 'N m', low=0.0, above='c', role='amplitude', linear=False),
        Parameter('v_s', 'rad/s', low=0.0, role='shape'),
    )
    equation = 'tau = -(c + (c_static - c) exp(-(w / v_s)^2)) sign(w)'
    looks_like = 'Sticks, breaks loose with a jerk, then slides with less friction.'
    confused_with = 'coulomb_friction if nothing is slower than v_s; voltage_deadband near rest.'
    reveal = 'Very slow reversals, so that many samples lie below and around v_s.'
    dry = True

    @staticmethod
    def law(
        c: float, c_static: float, v_s: float, q: float, dq: float, motor: float, load: float
    ) -> Any:
        level = c + (c_static - c) * np.exp(-((dq / np.maximum(v_s, 1e-9)) ** 2))
        return -np.copysign(level, dq)


class SmoothFriction(_Friction):
    """Dry friction that turns its sign over a range of speeds, as in most simulators."""

    name = 'smooth_friction'
    parameters = (
        Parameter('c', 'N m', low=0.0, role='amplitude', linear=False),
        Parameter('v_0', 'rad/s', neutral=0.1, low=0.0, role='shape'),
    )
    equation = 'tau = -c tanh(w / v_0)'
    looks_like = 'Amplitudes shrink as with dry friction, but nothing ever holds still: it creeps.'
    confused_with = 'coulomb_friction, which it holds, when hardly any motion is slower than v_0.'
    reveal = 'Very slow reversals, and a small torque that is held.'

    @staticmethod
    def law(c: float, v_0: float, _: float, q: float, dq: float, motor: float, load: float) -> Any:
        return -c * np.tanh(dq / np.maximum(v_0, 1e-9))


class LoadDependentFriction(_DryUnderLoad):
    """Dry friction in proportion to the torque the gear transmits."""

    name = 'load_dependent_friction'
    parameters = (Parameter('mu', '', low=0.0, role='amplitude', linear=False),)
    equation = 'tau = -mu |tau_motor - tau_load| sign(w)'
    looks_like = 'Dry friction that is strong under load, weak when the gear idles.'
    confused_with = 'coulomb_friction at one load; torque_scale while driving in one direction.'
    reveal = 'The same motion with and without payload, and driving with and against gravity.'

    @staticmethod
    def law(mu: float, _: float, __: float, q: float, dq: float, motor: float, load: float) -> Any:
        return -np.copysign(mu * np.abs(motor - load), dq)


class StribeckLoadFriction(_DryUnderLoad):
    """Dry friction in proportion to the torque the gear transmits, larger near rest."""

    name = 'stribeck_load_friction'
    parameters = (
        Parameter('mu', '', low=0.0, role='amplitude', linear=False),
        Parameter('mu_static', '', low=0.0, above='mu', role='amplitude', linear=False),
        Parameter('v_s', 'rad/s', low=0.0, role='shape'),
    )
    equation = 'tau = -(mu + (mu_static - mu) exp(-(w / v_s)^2)) |tau_motor - tau_load| sign(w)'
    looks_like = 'Under load it sticks and breaks loose with a jerk; without load it does not.'
    confused_with = 'load_dependent_friction, which it holds; stribeck_friction at one load.'
    reveal = 'Very slow reversals with and without payload.'

    @staticmethod
    def law(
        mu: float, mu_static: float, v_s: float, q: float, dq: float, motor: float, load: float
    ) -> Any:
        share = mu + (mu_static - mu) * np.exp(-((dq / np.maximum(v_s, 1e-9)) ** 2))
        return -np.copysign(share * np.abs(motor - load), dq)


class QuadraticLoadFriction(_DryUnderLoad):
    """Dry friction that grows faster than the torque the gear transmits."""

    name = 'quadratic_load_friction'
    parameters = (
        Parameter('mu', '', low=0.0, role='amplitude', linear=False),
        Parameter('mu2', '1/N m', low=0.0, role='amplitude', linear=False),
    )
    equation = 'tau = -(mu T + mu2 T^2) sign(w), T = |tau_motor - tau_load|'
    looks_like = 'Dry friction that takes a larger share of the torque the more there is of it.'
    confused_with = 'load_dependent_friction, which it holds, while the loads are alike.'
    reveal = 'The same motion with a light, a middle and a heavy payload.'

    @staticmethod
    def law(
        mu: float, mu2: float, _: float, q: float, dq: float, motor: float, load: float
    ) -> Any:
        carried = np.abs(motor - load)
        return -np.copysign(mu * carried + mu2 * carried * carried, dq)


class DirectionalLoadFriction(_DryUnderLoad):
    """Dry friction under load that differs with the direction in which power flows."""

    name = 'directional_load_friction'
    parameters = (
        Parameter('mu', '', low=0.0, role='amplitude', linear=False),
        Parameter('mu_back', '', low=0.0, role='amplitude', linear=False),
    )
    equation = 'tau = -m |tau_motor - tau_load| sign(w); m: mu if tau_motor w > 0, else mu_back'
    looks_like = 'Lifting costs another share of the torque than lowering the same weight.'
    confused_with = 'load_dependent_friction, which it holds, or torque_scale, if it always lifts.'
    reveal = 'Lift and lower the same weight, at the same speeds.'

    @staticmethod
    def law(
        mu: float, mu_back: float, _: float, q: float, dq: float, motor: float, load: float
    ) -> Any:
        """Torque at the joint, N m; of a joint at rest, against the motion that would begin."""
        way = np.where(np.abs(dq) < NOTHING, motor + load, dq)
        share = np.where(motor * way > NOTHING, mu, mu_back)
        return -np.copysign(share * np.abs(motor - load), dq)

    def places(self, robot: Robot) -> tuple[str, ...]:
        return tuple(actuator.joint for actuator in robot.actuators)
