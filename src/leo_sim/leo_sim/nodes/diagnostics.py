# SPDX-License-Identifier: Apache-2.0
"""What the robot node says about itself on /diagnostics once a second."""

from collections.abc import Mapping, Sequence
from typing import Any

from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus, KeyValue
from std_msgs.msg import Header

from leo_sim.drivers.safety import Faults, Safety


class Health:
    """How long a state takes, and how often one is a whole `period` [s] late; 0 is never late."""

    def __init__(self, period: float) -> None:
        self._period = period
        self.missed = 0
        self._reported = 0
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
        new, self._reported = self.missed - self._reported, self.missed
        return new


def robot_diagnostics(
    name: str,
    stamp: Any,
    safety: Safety,
    health: Health,
    torque: bool,
    faults: Faults,
    alarm: str,
    figures: Mapping[str, object],
    neighbours: Sequence[str],
) -> DiagnosticArray:
    """What a robot node says, with what is new since the last time.

    `torque`: motors on, not free; `alarm`: what the hardware says is wrong; `figures`: more.
    """
    count, mean, largest = health.take_loop_times()
    missed, lost = health.take_missed(), faults.take_new()
    stopped = f'e-stop: {safety.at_stop} until /robot/e_stop_reset'
    others = f'another robot obeys the same commands: {"".join(neighbours[:1])}'
    news = (  # the worst first
        (alarm, DiagnosticStatus.ERROR, alarm),
        (safety.e_stopped, DiagnosticStatus.ERROR, stopped),
        (neighbours, DiagnosticStatus.WARN, others),
        (lost, DiagnosticStatus.WARN, f'{lost} packets lost or damaged in the last second'),
        (safety.timed_out, DiagnosticStatus.WARN, f'no command: timed out, {safety.when_old}'),
        (missed, DiagnosticStatus.WARN, f'{missed} deadlines missed in the last second'),
        (torque, DiagnosticStatus.OK, 'running'),
        (True, DiagnosticStatus.OK, 'running, motors free'),
    )
    level, message = next((level, text) for is_so, level, text in news if is_so)
    values = {
        'states in the last second': count,
        'loop time mean ms': f'{mean:.3f}',
        'loop time max ms': f'{largest:.3f}',
        'missed deadlines': health.missed,
        'command timeouts': safety.timeouts,
        'rejected commands': safety.rejected,
        'e-stop': safety.e_stopped,
        'torque': torque,
        'other robots': ', '.join(neighbours) or 'none',
        'driver faults': faults.total,
        'last driver fault': faults.last,
        **figures,
    }
    pairs = [KeyValue(key=key, value=str(value)) for key, value in values.items()]
    status = DiagnosticStatus(name=name, level=level, message=message, values=pairs)
    return DiagnosticArray(header=Header(stamp=stamp), status=[status])
