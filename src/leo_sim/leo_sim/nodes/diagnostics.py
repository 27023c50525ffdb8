# SPDX-License-Identifier: Apache-2.0
"""What the robot node says about itself on /diagnostics once a second."""

from collections.abc import Mapping, Sequence
from typing import Any

from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus, KeyValue
from std_msgs.msg import Header

from leo_sim.nodes.loop import Loop


def robot_diagnostics(
    name: str,
    stamp: Any,
    loop: Loop,
    torque: bool,
    figures: Mapping[str, object],
    neighbours: Sequence[str],
) -> DiagnosticArray:
    """What a robot node says, with what is new since the last time; `torque`: motors on."""
    safety, health, faults, alarm = loop.safety, loop.health, loop.faults, loop.measured.alarm()
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
        'stopped by the watchdog': loop.gate.halts,
        **loop.measured.figures(),
    }
    pairs = [KeyValue(key=key, value=str(value)) for key, value in values.items()]
    status = DiagnosticStatus(name=name, level=level, message=message, values=pairs)
    return DiagnosticArray(header=Header(stamp=stamp), status=[status])
