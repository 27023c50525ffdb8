# SPDX-License-Identifier: Apache-2.0
"""Goals of servos that were wrapped apart from the angles, brought to the turn these are in.

An angle that goes on over a turn and a goal that was wrapped at pi for itself are 2 pi apart, and
no servo is. A goal that steps far is none of these: the joint then goes there the long way.
"""

from __future__ import annotations

from dataclasses import replace
import math

import numpy as np

from leo_sim.description.robot import Robot

from .inputs import InputLog
from .states import StateLog
from .types import Floats

NEAR_GOAL = 1.0
"""rad: so near its goal, less whole turns, a joint mostly is where the goal counts from
another turn."""
MOSTLY = 0.9
"""Share of the goals."""


def on_the_angles_turn(inputs: InputLog | None, states: StateLog, robot: Robot) -> InputLog | None:
    """Take off the turns by which goals were wrapped apart; a free motor and a slide have none."""
    if inputs is None or inputs.kind != 'position':
        return inputs
    t, at = states.log_ns - states.log_ns[0], inputs.log_ns - states.log_ns[0]
    values, notes = inputs.values.copy(), [*inputs.notes]
    for a, (motor, j) in enumerate(zip(robot.actuators, robot.actuated, strict=True)):
        on = inputs.enabled[:, a] > 0
        turns = _turns(values[on, a], np.interp(at[on], t, states.q[:, j]))
        if turns.any() and motor.joint not in robot.slides:
            values[on, a] -= math.tau * turns
            notes.append(
                f'{int((turns != 0).sum())} goals of {motor.joint} were wrapped apart from its '
                'angle; brought to the turn it is in'
            )
    return replace(inputs, values=values, notes=tuple(notes))


def _turns(goal: Floats, angle: Floats) -> Floats:
    """Whole turns that a goal is off by, shape (N,); zeros where it may be meant."""
    off = goal - angle
    nearest = np.round(off / math.tau)
    none = np.zeros_like(goal)
    if not nearest.any():
        return none
    near = np.abs(off - math.tau * nearest) < NEAR_GOAL
    if _leaps(goal - math.tau * nearest) < _leaps(goal) and near[nearest != 0].mean() >= MOSTLY:
        return nearest
    most = float(np.median(nearest))
    same = np.abs(off - math.tau * most) < NEAR_GOAL
    return none + most if most and same.mean() >= MOSTLY else none


def _leaps(goal: Floats) -> int:
    return int((np.abs(np.diff(goal)) > math.tau / 2).sum())
