# SPDX-License-Identifier: Apache-2.0
"""The own loop of position servos: from a goal to the voltage on the motor.

Goal and angle in counts of the encoder, their difference times a gain is the duty, at most 1, of
the supply (Rhoban BAM, bam/actuator.py and bam/feetech/actuator.py, commit 060af88e: duty = kp *
error_gain * (goal - q), clipped; volts = duty * supply; the goal moves at a limited rate).
"""

from collections.abc import Mapping, Sequence
from typing import Any, NamedTuple

import numpy as np

from leo_sim.common.broadcasting import Array, Index, Numbers, put, stacked
from leo_sim.effects.base import Effect, Parameter, Values
from leo_sim.laws.sensors import Sensors, Use

FINEST = 1e-12  # resolution of an encoder that counts nothing, rad


class Loop(NamedTuple):
    """Figures of the loops, (..., A)."""

    gain: Any  # duty for an error of 1 rad, 1/rad
    rate_gain: Any  # duty for a rate of 1 rad/s, s/rad
    grain: Any  # a count of the encoder, rad
    supply: Any  # V


class Servos:
    """The loops of all actuators of a robot.

    Paths are those of the actuators' constants, as 'actuators.pivot.'. Sensors are what the servos
    read of their joints, nothing that comes late; `after` are command effects that change the
    voltage at once. Size is the number of joints.
    """

    def __init__(
        self,
        paths: Sequence[str],
        values: Mapping[str, Any],
        sensors: Sensors,
        after: Sequence[Use],
        actuated: Index,
        size: int,
    ):
        def figures(key: str, default: float = 0.0) -> Any:
            return stacked([values.get(path + key, default) for path in paths])

        grain = np.maximum(figures('resolution'), FINEST)
        self.loop = Loop(figures('position_gain'), figures('rate_gain'), grain, figures('supply'))
        self.after, self.sensors, self._actuated = after, sensors, actuated
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
        gain, rate_gain, grain, _ = self.loop
        error = grain * (np.rint(goal / grain) - np.rint(angle / grain))
        return np.clip(gain * error - rate_gain * rate, -1.0, 1.0)

    def reading(self) -> tuple[Any, Any, Any]:
        """Scale, rate scale and zero, (..., J): servos read scale q + zero and rate_scale w."""
        still = np.zeros(self._size)
        zero, idle = self.sensors.sense(still, still, {}, 0.0)[:2]
        one, moving = self.sensors.sense(still + 1.0, still + 1.0, {}, 0.0)[:2]
        return one - zero, moving - idle, zero


class GoalRate(Effect):
    """The goal that the loop follows moves no faster than `rate`.

    Its memory is that goal; at the start it is where the first command says.
    """

    name = 'goal_rate'
    family = 'command'
    hook = 'command'
    parameters = (Parameter('rate', 'rad/s', neutral=float('inf'), low=0.0, role='threshold'),)
    dynamic = True
    rank = 15

    def command(self, p: Values, u: Array, memory: Any, dt: Numbers) -> tuple[Any, Any]:
        """The goal amid the next dt s, and at their end."""
        before = u if memory is None else memory
        most = p['rate'] * dt
        end = np.clip(u, before - most, before + most)
        return np.clip(u, before - 0.5 * most, before + 0.5 * most), end


def around_loop(
    commands: Sequence[Use], paths: Sequence[str], values: Mapping[str, Any]
) -> tuple[list[Use], list[Use]]:
    """Command effects before the loops and behind them, in their order.

    What is late or slow changes a goal, a limited rate among them; what acts at once changes the
    voltage.
    """
    rate = _goal_rate(paths, values)
    before = [u for u in commands if u.effect.dynamic] + ([] if rate is None else [rate])
    behind = [u for u in commands if not u.effect.dynamic]
    return sorted(before, key=lambda u: u.effect.rank), behind


def _goal_rate(paths: Sequence[str], values: Mapping[str, Any]) -> Use | None:
    """The limited rate of the goals, where an actuator has one."""
    rates = stacked([values.get(path + 'goal_rate', np.inf) for path in paths])
    if not np.isfinite(rates).any():
        return None
    return Use('goal_rate', GoalRate(), {'rate': rates}, slice(None))
