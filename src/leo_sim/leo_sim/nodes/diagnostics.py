# SPDX-License-Identifier: Apache-2.0
"""What the robot node says about itself on /diagnostics once a second."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus, KeyValue
from std_msgs.msg import Header

from leo_sim.drivers.safety import Safety


class Health:
    """Counts of the loop: how long a state takes, how often it came a whole period late.

    Args:
        period: time between two states on the wall's clock [s]; 0 in lockstep, never late.
    """

    def __init__(self, period: float) -> None:
        self._period = period
        self.missed = 0
        self._told = 0
        self._loop_times: list[float] = []

    def note(self, loop_time: float, lateness: float) -> None:
        """Add one state that took `loop_time` [s] and was late by `lateness` [s]."""
        self._loop_times.append(loop_time)
        self.missed += bool(self._period and lateness > self._period)

    def take_loop_times(self) -> tuple[int, float, float]:
        """Number of states since the last call, mean and largest loop time [ms]."""
        times, self._loop_times = self._loop_times, []
        if not times:
            return 0, 0.0, 0.0
        return len(times), 1e3 * sum(times) / len(times), 1e3 * max(times)

    def take_missed(self) -> int:
        """Number of deadlines missed since the last call."""
        new, self._told = self.missed - self._told, self.missed
        return new


def robot_status(
    name: str,
    safety: Safety,
    health: Health,
    torque: bool,
    new_missed: int,
    new_faults: int = 0,
    alarm: str = '',
    figures: Mapping[str, object] | None = None,
    neighbours: Sequence[str] = (),
) -> DiagnosticStatus:
    """The DiagnosticStatus of a robot node.

    Args:
        name: of the node.
        safety: what stands between commands and motors.
        health: of the loop.
        torque: motors on, not free.
        new_missed: deadlines missed since the last status.
        new_faults: packets lost or damaged since the last status.
        alarm: what the hardware says is wrong.
        figures: further names and values.
        neighbours: names of other robots that obey the same commands.
    """
    count, mean, largest = health.take_loop_times()
    status = DiagnosticStatus(name=name)
    status.level, status.message = _level(
        safety, torque, new_missed, new_faults, alarm, neighbours
    )
    status.values = [
        KeyValue(key=key, value=str(value))
        for key, value in (
            ('states in the last second', count),
            ('loop time mean ms', f'{mean:.3f}'),
            ('loop time max ms', f'{largest:.3f}'),
            ('missed deadlines', health.missed),
            ('command timeouts', safety.timeouts),
            ('rejected commands', safety.rejected),
            ('e-stop', safety.e_stopped),
            ('torque', torque),
            ('other robots', ', '.join(neighbours) or 'none'),
            *(figures or {}).items(),
        )
    ]
    return status


def diagnostic_array(status: DiagnosticStatus, stamp: Any) -> DiagnosticArray:
    """A DiagnosticArray of one status with a builtin_interfaces/Time."""
    return DiagnosticArray(header=Header(stamp=stamp), status=[status])


def _level(
    safety: Safety,
    torque: bool,
    new_missed: int,
    new_faults: int,
    alarm: str,
    neighbours: Sequence[str],
) -> tuple[Any, str]:
    if alarm:
        return DiagnosticStatus.ERROR, alarm
    if safety.e_stopped:
        return DiagnosticStatus.ERROR, f'e-stop: {safety.at_stop} until /robot/e_stop_reset'
    if neighbours:
        return DiagnosticStatus.WARN, f'another robot obeys the same commands: {neighbours[0]}'
    if new_faults:
        return DiagnosticStatus.WARN, f'{new_faults} packets lost or damaged in the last second'
    if safety.timed_out:
        return DiagnosticStatus.WARN, f'no command: timed out, {safety.when_old}'
    if new_missed:
        return DiagnosticStatus.WARN, f'{new_missed} deadlines missed in the last second'
    return DiagnosticStatus.OK, 'running' if torque else 'running, motors free'
