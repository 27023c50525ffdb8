# SPDX-License-Identifier: Apache-2.0
"""Effects on what reaches the motors of a command."""

from dataclasses import replace
from typing import Any

import numpy as np

from leo_sim.common.broadcasting import Array, Numbers
from leo_sim.description.robot import Robot
from leo_sim.effects.base import Effect, Parameter, Values
from leo_sim.effects.parameter import at_joints


class _Command(Effect):
    family = hook = 'command'

    def parameters_for(self, robot: Robot, where: tuple[str, ...]) -> tuple[Parameter, ...]:
        """What is in V is in N m (N on slides) where the robot takes torques."""
        unit = 'V' if robot.has_motor_law else 'N m'
        made = tuple(replace(p, unit=unit) if p.unit == 'V' else p for p in self.parameters)
        return at_joints(robot, where, made)


class CommandDelay(_Command):
    """Commands act `delay` seconds late.

    Continuous in the delay: the motor gets the mean of the held values over each substep. The
    memory (2, n, ..., actuators) holds the ages s of the last n changes of the command at the
    start of the substep, oldest first, and the commands from then on.
    """

    name = 'command_delay'
    parameters = (Parameter('delay', 's', low=0.0, high=0.5, role='delay'),)
    equation = 'u_motor(t) = u(t - delay)'
    looks_like = 'Every answer to a change of the command comes late by the same time.'
    confused_with = 'measurement_delay (the same but for free motors); actuator_lag, armature.'
    reveal = 'Steps and fast square waves, sampled at 100 Hz or more.'
    dynamic = True
    rank = 10

    def command(self, p: Values, u: Array, memory: Any, dt: Numbers) -> tuple[Any, Any]:
        delay = p['delay']
        memory = self._remember(u, memory)
        ages, held = memory
        late = u
        for older in range(len(held) - 1, 0, -1):
            share = 1.0 - np.clip((ages[older] + dt - delay) / np.maximum(dt, 1e-12), 0.0, 1.0)
            late = late - share * (held[older] - held[older - 1])
        return late, self._forget(np.stack([ages + dt, held]), np.max(delay))

    @staticmethod
    def _remember(u: Array, memory: Any) -> Any:
        """The memory with the command u as its newest entry, if it is new."""
        if memory is None:
            memory = np.zeros((2, 1, *np.shape(u)))
        u = np.broadcast_to(u, np.broadcast_shapes(np.shape(u), memory.shape[2:]))
        scanned = (1,) * (u.ndim + 2 - memory.ndim)
        memory = memory.reshape(*memory.shape[:2], *scanned, *memory.shape[2:])
        memory = np.broadcast_to(memory, (*memory.shape[:2], *u.shape))
        if np.array_equal(memory[1, -1], u):
            return memory
        newest = np.stack([np.zeros_like(u), u])[:, None]
        return np.concatenate([memory, newest], axis=1)

    @staticmethod
    def _forget(memory: Any, longest: float) -> Any:
        """The memory without the entries that no delay up to `longest` reaches any more."""
        ages = memory[0].reshape(memory.shape[1], -1).min(axis=1, initial=np.inf)
        spent = int(np.sum(ages[1:] >= longest))
        return memory[:, spent:]


class VoltageScale(_Command):
    """The motor gets k times the command."""

    name = 'voltage_scale'
    parameters = (Parameter('k', '', neutral=1.0, low=0.0, role='amplitude'),)
    equation = 'u_motor = k u'
    looks_like = 'Commands are stronger or weaker than sent; braking at 0 V is right.'
    confused_with = 'torque_scale (the same where torques are commanded or the constant refitted).'
    reveal = 'Runs at 0 V besides driven ones.'
    rank = 20

    @staticmethod
    def law(k: float, _: float, __: float, u: float) -> Any:
        return k * u


class VoltageDeadband(_Command):
    """Commands smaller than v do nothing, larger ones lose v."""

    name = 'voltage_deadband'
    parameters = (Parameter('v', 'V', low=0.0, role='threshold'),)
    equation = 'u_motor = sign(u) max(|u| - v, 0)'
    looks_like = 'Small commands have no effect; large ones are weaker by a constant.'
    confused_with = 'coulomb_friction of what hardly moves; voltage_scale at one amplitude.'
    reveal = 'Small and large commands, also while the joint coasts.'
    rank = 30

    @staticmethod
    def law(v: float, _: float, __: float, u: float) -> Any:
        return np.sign(u) * np.maximum(np.abs(u) - v, 0.0)


class VoltagePush(_Command):
    """The drive adds v in the direction of every command, as firmware that makes up for friction.

    The opposite of a dead band.
    """

    name = 'voltage_push'
    parameters = (Parameter('v', 'V', low=0.0, role='amplitude'),)
    equation = 'u_motor = u + v sign(u)'
    looks_like = 'Small commands do more than they should; large ones are stronger by a constant.'
    confused_with = 'voltage_scale at one amplitude; too much dry friction in the model.'
    reveal = 'Small and large commands, also against the motion.'
    rank = 35

    @staticmethod
    def law(v: float, _: float, __: float, u: float) -> Any:
        return u + v * np.sign(u)


class VoltageLimit(_Command):
    """Commands are clipped to +-v."""

    name = 'voltage_limit'
    parameters = (Parameter('v', 'V', neutral=float('inf'), low=0.0, role='threshold'),)
    equation = 'u_motor = min(max(u, -v), v)'
    looks_like = 'Right with small commands, too weak with large ones.'
    confused_with = 'voltage_scale when only large commands occur.'
    reveal = 'Commands from small to the largest allowed.'
    rank = 40

    @staticmethod
    def law(v: float, _: float, __: float, u: float) -> Any:
        return np.minimum(np.maximum(u, -v), v)

    def parameters_for(self, robot: Robot, where: tuple[str, ...]) -> tuple[Parameter, ...]:
        most = max(a.strongest for a in robot.actuators if a.joint in where)
        return tuple(replace(p, neutral=most) for p in super().parameters_for(robot, where))


class ActuatorLag(_Command):
    """The motor input follows the command as a first-order lag of time constant tau."""

    name = 'actuator_lag'
    parameters = (Parameter('tau', 's', low=0.0, high=1.0, role='delay'),)
    equation = 'tau du_motor/dt = u - u_motor'
    looks_like = 'Steps of the command arrive rounded.'
    confused_with = 'command_delay, above all with slow sampling; armature.'
    reveal = 'Steps and fast square waves, sampled at 100 Hz or more.'
    dynamic = True
    rank = 50

    def command(self, p: Values, u: Array, memory: Any, dt: Numbers) -> tuple[Any, Any]:
        before = np.zeros_like(u) if memory is None else memory
        steps = dt / np.maximum(p['tau'], 1e-200)
        decay = np.exp(-steps)
        mean = u + (before - u) * ((1.0 - decay) / steps)
        return mean, u + (before - u) * decay
