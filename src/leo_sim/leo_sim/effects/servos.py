# SPDX-License-Identifier: Apache-2.0
"""Effects on the own loop of a position servo: its gains, and how fast its goal moves."""

from dataclasses import replace
from typing import Any, ClassVar

import numpy as np

from leo_sim.common.broadcasting import Array, Numbers
from leo_sim.description.robot import Robot
from leo_sim.effects.base import Effect, Loop, Parameter, Values
from leo_sim.effects.parameter import at_joints

AT_ONCE = 10.0  # largest goals that a goal passes in a substep where its rate is not limited
FASTEST = 1e9  # rad/s2: of servos that let a goal go at once
BRAKING = 2e-3  # s: how often a servo with a limited acceleration looks how fast its goal may be


class _Servo(Effect):
    family = hook = 'servo'
    replaced: ClassVar[tuple[str, ...]] = ()  # figures of the robot file that its parameter is
    order: ClassVar[int] = 1  # of the derivative of the goal that it limits

    def places(self, robot: Robot) -> tuple[str, ...]:
        return super().places(robot) if robot.input == 'position' else ()

    def parameters_for(self, robot: Robot, where: tuple[str, ...]) -> tuple[Parameter, ...]:
        (parameter,), known = self.parameters, robot.constants
        paths = (f'actuators.{joint}.{figure}' for joint in where for figure in self.replaced)
        if own := [known[path] for path in paths if path in known]:
            return (replace(parameter, neutral=max(c.value for c in own), unit=own[0].unit),)
        if np.isinf(parameter.neutral):
            at_once = AT_ONCE * max(robot.limits) / robot.integration_step**self.order
            parameter = replace(parameter, neutral=float(at_once))
        return at_joints(robot, where, (parameter,))


class ServoStiffness(_Servo):
    """The servo's position gain is k times the robot file's."""

    name = 'servo_stiffness'
    parameters = (Parameter('k', '', neutral=1.0, low=0.0, role='amplitude'),)
    equation = 'duty = k position_gain (goal - q) - rate_gain w, at most 1'
    looks_like = 'Gravity and friction keep the joint further from its goal, or less far.'
    confused_with = 'voltage_scale (the same while the duty stays below 1 and the loop has no D).'
    reveal = 'Steps of the goal so large that the servo gives all it has, and small ones.'

    def servo(self, p: Values, loop: Loop) -> Loop:
        return loop._replace(gain=p['k'] * loop.gain)


class ServoDamping(_Servo):
    """The servo's rate gain, the D of its loop, is d in place of the robot file's."""

    name = 'servo_damping'
    parameters = (Parameter('d', 's/rad', low=0.0, role='amplitude'),)
    equation = 'duty = position_gain (goal - q) - d w, at most 1'
    looks_like = 'Swings about a goal die out faster, or go on; full speed is right.'
    confused_with = 'viscous_friction, back_emf_scale (the same while the duty stays below 1).'
    reveal = 'Steps of the goal, small ones and such that the servo gives all it has.'
    replaced = 'rate_gain', 'damping'

    def servo(self, p: Values, loop: Loop) -> Loop:
        return loop._replace(rate_gain=loop.share * p['d'])


class GoalRate(_Servo):
    """The servo lets its goal move no faster than `rate`, its profile velocity.

    The memory of `command` is that goal; at the start it is where the first command says, or where
    the joint was when a history begins.
    """

    name = 'goal_rate'
    parameters = (Parameter('rate', 'rad/s', neutral=float('inf'), low=0.0, role='threshold'),)
    equation = '|d goal / dt| is at most rate'
    looks_like = 'After a step of the goal the joint comes late, at one speed.'
    confused_with = 'voltage_limit and viscous_friction, which slow large steps too.'
    reveal = 'Steps of the goal, large and small.'
    dynamic = True
    rank = 15
    replaced = ('goal_rate',)

    def servo(self, p: Values, loop: Loop) -> Loop:
        return loop._replace(goal_rate=p['rate'])

    @staticmethod
    def resting(q: Array, dq: Array) -> Any:
        """The memory of a goal that is where the joint is."""
        return q

    def command(self, p: Values, u: Array, memory: Any, dt: Numbers) -> tuple[Any, Any]:
        """The goal amid the next dt s, and at their end."""
        before = u if memory is None else memory
        most = p['rate'] * dt
        end = np.clip(u, before - most, before + most)
        return np.clip(u, before - 0.5 * most, before + 0.5 * most), end


class GoalAcceleration(_Servo):
    """The servo lets the rate of its goal change no faster than `a`, its profile acceleration.

    The memory of `command` is that goal and its rate.
    """

    name = 'goal_acceleration'
    parameters = (Parameter('a', 'rad/s2', neutral=float('inf'), low=0.0, role='threshold'),)
    equation = '|d2 goal / dt2| is at most a, and the goal stops where it was sent'
    looks_like = 'After a step of the goal the joint sets off and arrives gently, small steps too.'
    confused_with = 'actuator_lag, armature; goal_rate where all steps are of one size.'
    reveal = 'Steps of the goal, large and small, and with little load.'
    dynamic = True
    rank = 15
    order = 2

    def servo(self, p: Values, loop: Loop) -> Loop:
        return loop._replace(goal_acceleration=p['a'])

    @staticmethod
    def resting(q: Array, dq: Array) -> Any:
        return np.stack(np.broadcast_arrays(q, dq))

    def command(self, p: Values, u: Array, memory: Any, dt: Numbers) -> tuple[Any, Any]:
        """The mean goal over the next dt s; goal and rate at their end, (2, ..., A)."""
        count = max(1, round(float(np.max(dt)) / BRAKING))
        now = np.stack([u, np.zeros_like(u)]) if memory is None else memory
        goals = []
        for _ in range(count):
            now, goal = _braked(p, u, now, np.maximum(dt, 1e-12) / count)
            goals.append(goal)
        return sum(goals) / count, now


def _braked(p: Values, u: Array, now: Any, dt: Numbers) -> tuple[Any, Any]:
    """Goal and rate after dt s, no faster than lets it brake where it was sent; mean goal."""
    (goal, rate), a = now, np.minimum(p['a'], FASTEST)
    left, change = u - goal, a * dt
    stops = 4.0 * a * np.abs(left) / (np.sqrt(change**2 + 8.0 * a * np.abs(left)) + change)
    most = np.minimum(np.minimum(stops, p.get('rate', np.inf)), np.abs(left) / dt)
    rate = np.clip(np.sign(left) * most, rate - change, rate + change)
    return np.stack(np.broadcast_arrays(goal + rate * dt, rate)), goal + 0.5 * rate * dt
