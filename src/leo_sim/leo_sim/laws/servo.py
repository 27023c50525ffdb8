# SPDX-License-Identifier: Apache-2.0
"""The own loop of position servos: from a goal to the voltage on the motor.

Goal and angle in counts of the encoder, their difference times a gain is the duty, at most 1, of
the supply (Rhoban BAM, bam/actuator.py and bam/feetech/actuator.py, commit 060af88e: duty = kp *
error_gain * (goal - q), clipped; volts = duty * supply; the goal moves at a limited rate).
"""

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from leo_sim.common.broadcasting import Array, Index, put, stacked
from leo_sim.effects.base import Loop
from leo_sim.effects.servos import GoalAcceleration, GoalRate
from leo_sim.laws.sensors import Sensors, Use

RAMP = 'goal_rate'  # in the memory: goals that servos move at a limited rate, rad
FINEST = 1e-12  # resolution of an encoder that counts nothing, rad


def loop_of(paths: Sequence[str], values: Mapping[str, Any]) -> Loop:
    """Figures of the loops, (..., A); paths are those of constants, as 'actuators.pivot.'.

    Gains in N m/rad are shares of the largest torque, which takes the place of the supply.
    """

    def figures(key: str, default: float = 0.0, other: str = '') -> Any:
        return stacked([values.get(p + key, values.get(p + other, default)) for p in paths])

    most, grain = figures('effort', 1.0), np.maximum(figures('resolution'), FINEST)
    gain = figures('stiffness', 0.0, 'position_gain') / most
    rate_gain = figures('damping', 0.0, 'rate_gain') / most
    supply, goal_rate = figures('effort', 0.0, 'supply'), figures('goal_rate', np.inf)
    endless = np.full_like(most, np.inf)
    return Loop(gain, rate_gain, grain, supply, goal_rate, 1.0 / most, endless)


class Servos:
    """The loops of all actuators of a robot, figures (..., A).

    Sensors are what the servos read of their joints, nothing that comes late; `after` are command
    effects that change the voltage at once. Size is the number of joints.
    """

    def __init__(
        self, loop: Loop, sensors: Sensors, after: Sequence[Use], actuated: Index, size: int
    ):
        self.loop, self.after, self.sensors, self._actuated = loop, after, sensors, actuated
        self._size = size

    def voltage(self, goal: Array, q: Array, dq: Array) -> Any:
        """What is on the motors, V, (..., A), for goals rad, (..., A), at true angles (..., J)."""
        volts = self.duty(goal, q, dq) * self.loop.supply
        for use in self.after:
            part = use.effect.command(use.values, volts[..., use.at], None, 0.0)[0]
            volts = put(volts, use.at, part)
        return volts

    def duty(self, goal: Any, q: Array, dq: Array) -> Any:
        """The share of the supply that the loops ask for, -1 to 1, (..., A); as `voltage`."""
        angle, rate = (read[..., self._actuated] for read in self.sensors.sense(q, dq, {}, 0)[:2])
        gain, rate_gain, grain, *_ = self.loop
        error = grain * (np.rint(goal / grain) - np.rint(angle / grain))
        return np.clip(gain * error - rate_gain * rate, -1.0, 1.0)

    def reading(self) -> tuple[Any, Any, Any]:
        """Scale, rate scale and zero, (..., J): servos read scale q + zero and rate_scale w."""
        still = np.zeros(self._size)
        zero, idle = self.sensors.sense(still, still, {}, 0.0)[:2]
        one, moving = self.sensors.sense(still + 1.0, still + 1.0, {}, 0.0)[:2]
        return one - zero, moving - idle, zero


def around_loop(commands: Sequence[Use], loop: Loop) -> tuple[list[Use], list[Use]]:
    """Command effects before the loops and behind them, in their order.

    What is late or slow changes a goal, a limited rate among them; what acts at once changes the
    voltage.
    """
    before = [u for u in commands if u.effect.dynamic]
    limits = {'rate': loop.goal_rate, 'a': loop.goal_acceleration}
    if np.isfinite(limits['a']).any():
        before.append(Use(RAMP, GoalAcceleration(), limits, slice(None)))
    elif np.isfinite(limits['rate']).any():
        before.append(Use(RAMP, GoalRate(), limits, slice(None)))
    behind = [u for u in commands if not u.effect.dynamic]
    return sorted(before, key=lambda u: u.effect.rank), behind
