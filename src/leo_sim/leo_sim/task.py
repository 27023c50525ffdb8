# SPDX-License-Identifier: Apache-2.0
"""Observation, reward and termination as robot.yaml declares them, over any leading axes."""
from typing import Any, Protocol

import numpy as np

from leo_sim.robot import Robot


class Motion(Protocol):
    """Anything with angles and rates, (..., J)."""

    @property
    def q(self) -> Any:
        """Angles rad."""

    @property
    def dq(self) -> Any:
        """Rates rad/s."""


def observation(robot: Robot, q: Any, dq: Any) -> np.ndarray:
    """What the agent sees, (..., n) in the order of robot.yaml; the plain state without a list."""
    if not robot.observation:
        return np.concatenate([q, dq], axis=-1)
    return np.stack([_quantity(robot, term.quantity, term.joint, q, dq)
                     for term in robot.observation], axis=-1)


def reward(robot: Robot, state: Motion, inputs: Any, next_state: Motion) -> Any:
    """Reward of one control step, (...): sum of weight (quantity - target)^power.

    Quantities are those after the step, inputs those applied in it (V or N m).
    """
    total: Any = 0.0
    for term in robot.reward:
        if term.quantity == 'input':
            names = [a.joint for a in robot.actuators]
            error = np.asarray(inputs)[..., names.index(term.joint)] - term.target
        elif term.quantity == 'wrapped_angle':
            angle = _quantity(robot, 'angle', term.joint, next_state.q, next_state.dq)
            error = wrapped(angle - term.target)
        else:
            error = _quantity(robot, term.quantity, term.joint, next_state.q,
                              next_state.dq) - term.target
        total = total + term.weight * error ** term.power
    return total


def terminated(robot: Robot, state: Motion) -> Any:
    """Whether the episode ends in a state, (...): some quantity has left its range."""
    over: Any = np.zeros(np.shape(state.q)[:-1], dtype=bool)
    for term in robot.termination:
        value = _quantity(robot, term.quantity, term.joint, state.q, state.dq)
        over = over | (value < term.low) | (value > term.high)
    return over


def wrapped(angle: Any) -> Any:
    """Angles brought to (-pi, pi]."""
    return np.pi - (np.pi - np.asarray(angle)) % (2 * np.pi)


_QUANTITIES = {
    'angle': lambda q, dq: q,
    'wrapped_angle': lambda q, dq: wrapped(q),
    'cos': lambda q, dq: np.cos(q),
    'sin': lambda q, dq: np.sin(q),
    'rate': lambda q, dq: dq,
}


def _quantity(robot: Robot, quantity: str, joint: str, q: Any, dq: Any) -> Any:
    j = robot.joint_names.index(joint)
    return _QUANTITIES[quantity](np.asarray(q)[..., j], np.asarray(dq)[..., j])
