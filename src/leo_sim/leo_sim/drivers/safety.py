# SPDX-License-Identifier: Apache-2.0
"""What stands between a command and a motor: time-out, latched e-stop, clip and slew limit.

The same for every driver, and plain classes: they know no ROS and no clock, the caller brings the
time. It is not a certified safety function; a real rig also needs a switch that cuts the supply.
"""

from collections.abc import Sequence
import math
from typing import ClassVar

import numpy as np

from leo_msgs_py.errors import UserError
from leo_msgs_py.values import Applied
from leo_sim.drivers.base import DriverFault, DriverInfo

MOST = 100.0  # times what the robot can take: no controller asks for that, garbage does


class BadCommand(ValueError):
    """What was expected of a command and what came; the one before it holds."""


class Safety:
    """Turn commands into the values that may be written to the actuators now.

    Args:
        limits: largest absolute value per actuator [V or N m], above 0, shape (A,).
        timeout: age [s] at which a command is dropped for 0; 0 disables.
        slew: largest change per second [V/s or N m/s]; 0 disables. Stopping is never slowed.
        period: between two outputs [s]; one that comes later changes no more than in a period.

    Raises:
        UserError: a limit that is not above 0, or a time or slew below 0.
    """

    at_stop: ClassVar[str] = '0'  # what an e-stop does, in words
    when_old: ClassVar[str] = '0 until the next one'  # what becomes of a command that grew too old
    when_blind: ClassVar[str] = '0'  # what is sent where the robot could not be measured
    at_end: ClassVar[str] = 'motors at 0'  # how the motors are left

    def __init__(
        self,
        limits: Sequence[float] | np.ndarray,
        timeout: float = 0.2,
        slew: float = 0.0,
        period: float = math.inf,
    ) -> None:
        limits = _above_zero(limits)
        self._low, self._high = -limits, limits
        self._timeout = _at_least_zero('command_timeout', timeout, 's')
        self._slew = _at_least_zero('slew', slew, 'per s')
        self._period = period
        self.e_stopped = False  # latched until `e_stop_reset`
        self.timed_out = False  # the last command grew too old; ends with the next command
        self.timeouts = self.rejected = 0  # commands that grew too old, and that were refused
        self.why = ''  # the last one was refused
        self.release()

    def accept(self, values: Sequence[float] | np.ndarray, now: float) -> None:
        """Latch a command, (A,), that arrived at robot time `now` [s], or raise BadCommand."""
        command = np.array(values, dtype=float).ravel()
        if self._refuses(command):
            self.rejected += 1
            raise BadCommand(f'command ignored: {self.why}')
        self._command, self._since = command, now
        self.timed_out = False

    def output(self, now: float, blind: bool = False) -> np.ndarray:
        """The values to write at time `now` [s], (A,): 0 when stopped, timed out or unmeasured."""
        if self.stops(now) or blind:
            self._last = self._stopped()
        else:
            self._last = self._slewed(np.clip(self._command, self._low, self._high), now)
        self._last_time = now
        return self._last.copy()

    def stops(self, now: float) -> bool:
        """Whether e-stop, or a command too old at time `now` [s], holds the robot at 0."""
        return self.e_stopped or self._is_too_old(now)

    def must_halt(self, now: float, silent: bool = False) -> bool:
        """Whether nothing may drive the robot at time `now` [s], in a loop that may hang."""
        return silent or self.stops(now)

    def drives(self, values: np.ndarray) -> bool:
        return bool(np.any(values))

    def see(self, angles: np.ndarray) -> None:
        """Where the actuated joints are now [rad], (A,)."""

    def took(self, applied: Applied | None) -> None:
        """What the driver made of the last output."""

    def torque_switched(self) -> None:
        """The motors were freed, or are on again."""

    def e_stop(self) -> None:
        self.e_stopped = True

    def e_stop_reset(self) -> None:
        self.e_stopped = False
        self.release()

    def release(self) -> None:
        self._command = self._idle()
        self._last = self._idle()
        self._since = math.inf
        self._last_time = math.inf
        self.timed_out = False

    def _refuses(self, command: np.ndarray) -> bool:
        takes = np.maximum(-self._low, self._high)
        if command.size != takes.size:
            self.why = f'it has {command.size} values, the robot has {takes.size} actuators'
        elif not np.isfinite(command).all():
            self.why = f'{command.tolist()} has values that are not finite'
        elif (np.abs(command) > MOST * takes).any():
            self.why = f'{command.tolist()} is beyond {MOST:g} times what the robot can take'
        else:
            return False
        return True

    def _idle(self) -> np.ndarray:
        return np.zeros_like(self._high)

    def _stopped(self) -> np.ndarray:
        return self._idle()

    def _is_too_old(self, now: float) -> bool:
        if not self._timeout or self.timed_out or now - self._since <= self._timeout:
            return self.timed_out
        self.timed_out = True
        self.timeouts += 1
        return True

    def _slewed(self, wanted: np.ndarray, now: float) -> np.ndarray:
        if not self._slew:
            return wanted
        step = self._slew * min(max(0.0, now - self._last_time), self._period)
        return np.clip(wanted, self._last - step, self._last + step)


class GoalSafety(Safety):
    """Turn goals into those that may be sent to position servos now; NaN frees a motor.

    0 is a place to go to and no rest:

    * Before the first command, after a reset, and when the torque is on again: motors free.
      Nothing moves to where some goal of before was.
    * No command for as long as the time-out, a state that could not be read, or a loop that
      hangs: the servo holds the last goal it was sent. Freed, an arm would fall.
    * E-stop: motors free, latched. A servo that goes on pushing is not stopped; an arm must be
      held up by other means (a spring, a brake), as when its supply is cut.

    Args:
        goals: lowest and highest goal of each actuator [rad], shape (2, A).
        timeout: age [s] at which a command is too old; 0 disables.
        slew: how fast a goal may move [rad/s], at first from where the joint is; 0 disables.
    """

    at_stop: ClassVar[str] = 'motors free'
    when_old: ClassVar[str] = 'the last goal is held until the next one'
    when_blind: ClassVar[str] = 'the last goal'
    at_end: ClassVar[str] = 'motors free'

    def __init__(
        self, goals: np.ndarray, timeout: float = 0.2, slew: float = 0.0, period: float = math.inf
    ) -> None:
        self._seen = np.full(goals.shape[1], np.nan)
        self._were_free = np.ones(goals.shape[1], dtype=bool)
        super().__init__(np.ones(goals.shape[1]), timeout, slew, period)
        self._low, self._high = goals

    def must_halt(self, now: float, silent: bool = False) -> bool:
        """Whether e-stop forbids any torque; what is only too old, or silent, is held."""
        return self.e_stopped

    def drives(self, values: np.ndarray) -> bool:
        return bool(np.isfinite(values).any())

    def see(self, angles: np.ndarray) -> None:
        self._seen = np.array(angles, dtype=float)

    def took(self, applied: Applied | None) -> None:
        """A motor that was free goes on from the place where its torque came on."""
        if applied is not None:
            begun = self._were_free & np.isfinite(self._last)
            self._last = np.where(begun, applied.nan_where_free, self._last)

    def torque_switched(self) -> None:
        self.release()

    def _idle(self) -> np.ndarray:
        return np.full_like(self._seen, np.nan)

    def _stopped(self) -> np.ndarray:
        self._were_free[:] = False
        return self._idle() if self.e_stopped else self._last

    def _slewed(self, wanted: np.ndarray, now: float) -> np.ndarray:
        free = self._were_free = np.isnan(self._last)
        self._last = np.where(free, self._seen, self._last)
        return np.clip(super()._slewed(wanted, now), self._low, self._high)


def safety_for(info: DriverInfo, timeout: float, slew: float) -> Safety:
    period = 1.0 / info.state_rate
    if info.goals is not None:
        return GoalSafety(info.goals, timeout, slew, period)
    return Safety(info.limits, timeout, slew, period)


class Faults:
    """Count the periods in which a packet was lost or damaged; `patience` in a row are borne."""

    def __init__(self, patience: int) -> None:
        self._patience = patience
        self.total = self.in_a_row = 0
        self.last = ''

    def note(self, why: str) -> None:
        """A period is over, `why` failed in it ('': nothing); DriverFault: too many in a row."""
        if not why:
            self.in_a_row = 0
            return
        self.total += 1
        self.in_a_row += 1
        self.last = why
        if self.in_a_row > self._patience:
            raise DriverFault(f'{self.in_a_row} periods in a row failed, the last one: {why}')


def _above_zero(limits: Sequence[float] | np.ndarray) -> np.ndarray:
    values = np.array(limits, dtype=float)
    if not (np.isfinite(values) & (values > 0.0)).all():
        raise UserError(
            f'limits of the actuators are {values.tolist()}; give finite numbers '
            'above 0 (robot.yaml, actuators: limit)'
        )
    return values


def _at_least_zero(name: str, value: float, unit: str) -> float:
    if not (math.isfinite(value) and value >= 0.0):
        raise UserError(f'{name} is {value} {unit}; give 0 (off) or a positive number')
    return float(value)
