# SPDX-License-Identifier: Apache-2.0
"""Safety for servos that take positions: 0 is a place to go to and no rest.

* Before the first command, after a reset, and when the torque is on again: motors free. Nothing
  moves to where some goal of before was.
* No command for as long as the time-out, a state that could not be read, or a loop that hangs:
  the servo holds the last goal it was sent. Freed, an arm would fall.
* E-stop: motors free, latched. A servo that goes on pushing is not stopped; an arm must be held
  up by other means (a spring, a brake), as when its supply is cut.
"""

from __future__ import annotations

from typing import ClassVar

import numpy as np

from leo_sim.drivers.base import DriverInfo
from leo_sim.drivers.safety import Safety


class GoalSafety(Safety):
    """Turn goals into those that may be sent to position servos now; NaN frees a motor.

    Args:
        goals: lowest and highest goal of each actuator [rad], shape (2, A).
        timeout: age [s] at which a command is too old; 0 disables.
        slew: how fast a goal may move [rad/s], at first from where the joint is; 0 disables.
    """

    at_stop: ClassVar[str] = 'motors free'
    when_old: ClassVar[str] = 'the last goal is held until the next one'
    when_blind: ClassVar[str] = 'the last goal'
    at_end: ClassVar[str] = 'motors free'

    def __init__(self, goals: np.ndarray, timeout: float = 0.2, slew: float = 0.0) -> None:
        self._seen = np.full(goals.shape[1], np.nan)
        super().__init__(np.ones(goals.shape[1]), timeout, slew)
        self._low, self._high = goals

    def must_halt(self, now: float, silent: bool = False) -> bool:
        """Whether e-stop forbids any torque; what is only too old, or silent, is held."""
        return self.e_stopped

    def drives(self, values: np.ndarray) -> bool:
        """Whether a motor has a goal."""
        return bool(np.isfinite(values).any())

    def see(self, angles: np.ndarray) -> None:
        """Where the actuated joints are now [rad], (A,)."""
        self._seen = np.array(angles, dtype=float)

    def torque_switched(self) -> None:
        """A free joint moves: goals of before are none of now."""
        self.release()

    def _idle(self) -> np.ndarray:
        return np.full_like(self._seen, np.nan)

    def _stopped(self) -> np.ndarray:
        return self._idle() if self.e_stopped else self._last

    def _slewed(self, wanted: np.ndarray, now: float) -> np.ndarray:
        free = np.isnan(self._last)
        self._last = np.where(free, self._seen, self._last)
        return np.clip(super()._slewed(wanted, now), self._low, self._high)


def safety_for(info: DriverInfo, timeout: float, slew: float) -> Safety:
    """The safety for what a driver takes: V, N m or goals.

    Raises:
        UserError: a limit that is not above 0, or a time or slew below 0.
    """
    if info.goals is not None:
        return GoalSafety(info.goals, timeout, slew)
    return Safety(info.limits, timeout, slew)
