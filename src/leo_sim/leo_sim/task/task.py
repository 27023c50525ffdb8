# SPDX-License-Identifier: Apache-2.0
"""Observation, reward and termination as robot.yaml declares them, over any leading axes."""

from collections.abc import Sequence
from functools import cached_property
from typing import Any, get_args, NamedTuple

import numpy as np

from leo_sim.common.broadcasting import Array, Numbers
from leo_sim.description.robot import Robot
from leo_sim.description.robot_file import OfJoint, OfStep, RewardFile
from leo_sim.kinematics.gait import Gait
from leo_sim.model.state import State

QUANTITIES = get_args(OfJoint)


class _Step(NamedTuple):
    """One control step, the foot that carries at its end, and whether it ends the episode."""

    before: State
    inputs: np.ndarray
    after: State
    stance: Any
    ended: Any


class Task:
    def __init__(self, robot: Robot):
        self.robot = robot
        self._remembers = any(term.quantity == 'ankle_forward' for term in robot.reward)
        rules = [rule for rule in robot.termination if rule.quantity in QUANTITIES]
        self._watched = _columns(robot, rules)
        self._low, self._high = np.reshape([(r.low, r.high) for r in rules], (-1, 2)).T
        self._heights = [r for r in robot.termination if r.quantity == 'height_over_feet']
        self._motors = np.array([(a.torque_constant, a.resistance) for a in robot.actuators]).T

    def reward(
        self, stance: Any, before: State, inputs: Array, after: State, ended: Any = None
    ) -> tuple[Any, Any]:
        """Reward of one control step, and who carries then, (...) each.

        The reward is the sum of weight (quantity - target)^power; quantities of joints are those
        of the state after. Stance is the foot that carries, an index in `robot.feet`, (...): 0 at
        the start of an episode, then what this method returned. Ended is what `terminated` says,
        where that is known already.
        """
        if ended is None:
            ended = self.terminated(after)
        if self._remembers:
            stance = self._gait.stance(after.q, stance)
        step = _Step(before, np.asarray(inputs), after, stance, ended)
        total: Any = 0.0
        for term in self.robot.reward:
            total = total + term.weight * self._error(term, step) ** term.power
        return total, stance

    def terminated(self, state: State) -> Any:
        """Whether the episode ends in a state, (...): some quantity has left its range."""
        values = _features(state.q, state.dq)[..., self._watched]
        over = np.any((values < self._low) | (values > self._high), axis=-1)
        for rule in self._heights:
            height = self._gait.height_over_feet(rule.joint, state.q)
            over = over | (height < rule.low) | (height > rule.high)
        return over

    def motor_power(self, dq: Array, volts: Array, dq_next: Array) -> Any:
        """Electrical power the motors take in a control step, W, (...), for volts (..., A).

        Sum of max(0, u i), with the current at the mean of the rates before and after: no
        credit for what a driven motor gives back (thesis).
        """
        constant, resistance = self._motors
        speed = 0.5 * (np.asarray(dq) + np.asarray(dq_next))[..., list(self.robot.actuated)]
        current = (volts - constant * speed) / resistance
        return np.sum(np.maximum(0.0, volts * current), axis=-1)

    @cached_property
    def _gait(self) -> Gait:
        return Gait(self.robot)

    def _error(self, term: RewardFile, step: _Step) -> Any:
        if term.quantity in get_args(OfStep):
            return self._whole(term.quantity, step) - term.target
        if term.quantity == 'input':
            motors = [a.joint == term.joint for a in self.robot.actuators]
            return step.inputs[..., motors.index(True)] - term.target
        value = _features(step.after.q, step.after.dq)[..., _columns(self.robot, [term])]
        error = value[..., 0] - term.target
        return wrapped(error) if term.quantity == 'wrapped_angle' else error

    def _whole(self, name: str, step: _Step) -> Any:
        if name == 'step':
            return 1.0
        if name == 'fall':
            return np.where(step.ended, 1.0, 0.0)
        if name == 'motor_power':
            return self.motor_power(step.before.dq, step.inputs, step.after.dq)
        if name == 'com_forward':
            return self._gait.com_x(step.after.q) - self._gait.com_x(step.before.q)
        # The distance before, seen from the foot that carries now: a footstep changes its sign.
        stride = self._gait.stride
        return stride(step.after.q, step.stance) - stride(step.before.q, step.stance)


def observation(robot: Robot, q: Array, dq: Array) -> np.ndarray:
    """What the agent sees, (..., n) in the order of robot.yaml; the plain state without a list."""
    if not robot.observation:
        return np.concatenate([q, dq], axis=-1)
    return _features(q, dq)[..., _columns(robot, robot.observation)]


def wrapped(angle: Numbers) -> Any:
    """Angles brought to (-pi, pi]."""
    return np.pi - (np.pi - np.asarray(angle)) % (2 * np.pi)


def _features(q: Array, dq: Array) -> np.ndarray:
    """All quantities of all joints, (..., 5 J), in the order of QUANTITIES."""
    return np.concatenate([q, wrapped(q), np.cos(q), np.sin(q), dq], axis=-1)


def _columns(robot: Robot, terms: Sequence[Any]) -> list[int]:
    """Where the quantities of terms are among the features."""
    kind, joints = QUANTITIES.index, robot.joint_names
    return [kind(t.quantity) * len(joints) + joints.index(t.joint) for t in terms]
