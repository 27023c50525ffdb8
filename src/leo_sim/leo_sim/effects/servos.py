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


class _Servo(Effect):
    family = hook = 'servo'
    replaced: ClassVar[tuple[str, ...]] = ()  # figures of the robot file that its parameter is

    def places(self, robot: Robot) -> tuple[str, ...]:
        return super().places(robot) if robot.input == 'position' else ()

    def parameters_for(self, robot: Robot, where: tuple[str, ...]) -> tuple[Parameter, ...]:
        (parameter,), known = self.parameters, robot.constants
        paths = (f'actuators.{joint}.{figure}' for joint in where for figure in self.replaced)
        if own := [known[path] for path in paths if path in known]:
            return (replace(parameter, neutral=max(c.value for c in own), unit=own[0].unit),)
        if np.isinf(parameter.neutral):
            at_once = AT_ONCE * max(robot.limits) / robot.integration_step
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

    def command(self, p: Values, u: Array, memory: Any, dt: Numbers) -> tuple[Any, Any]:
        """The goal amid the next dt s, and at their end."""
        before = u if memory is None else memory
        most = p['rate'] * dt
        end = np.clip(u, before - most, before + most)
        return np.clip(u, before - 0.5 * most, before + 0.5 * most), end
