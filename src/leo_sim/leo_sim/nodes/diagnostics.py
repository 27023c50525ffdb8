# SPDX-License-Identifier: Apache-2.0
"""What the robot node says about itself on /diagnostics once a second."""

from collections import Counter
from collections.abc import Sequence
from typing import Any

from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus
from std_msgs.msg import Header

from leo_msgs_py.values import status_message
from leo_sim.nodes.commander import Commander
from leo_sim.nodes.loop import Loop


def robot_diagnostics(
    name: str,
    stamp: Any,
    loop: Loop,
    torque: bool,
    commander: Commander,
    neighbours: Sequence[str],
) -> DiagnosticArray:
    """What a robot node says, with what is new since the last time.

    `torque`: motors on; `neighbours` are other robots that obey the same commands.
    """
    safety, health, faults = loop.safety, loop.health, loop.faults
    count, mean, largest = health.take_loop_times()
    level, text = _worst(loop, torque, neighbours)
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
        'stale commands': commander.ages.stale,
        'commanders': commander.count,
        'stopped by the watchdog': loop.gate.halts,
        **loop.measured.figures(),
    }
    status = status_message(name, level, text, values)
    return DiagnosticArray(header=Header(stamp=stamp), status=[status])


def _worst(loop: Loop, torque: bool, neighbours: Sequence[str]) -> tuple[Any, str]:
    safety, alarm = loop.safety, loop.measured.alarm()
    new = Counter(missed=loop.health.missed, lost=loop.faults.total, refused=safety.rejected)
    new.subtract(loop.told)
    loop.told.update(new)
    if alarm:
        return DiagnosticStatus.ERROR, alarm
    if safety.e_stopped:
        return DiagnosticStatus.ERROR, f'e-stop: {safety.at_stop} until /robot/e_stop_reset'
    if neighbours:
        return DiagnosticStatus.WARN, f'another robot obeys the same commands: {neighbours[0]}'
    if new['lost']:
        return DiagnosticStatus.WARN, f'{new["lost"]} packets lost or damaged in the last second'
    if new['refused']:
        text = f'{new["refused"]} commands ignored in the last second, the last one: {safety.why}'
        return DiagnosticStatus.WARN, text
    if safety.timed_out:
        return DiagnosticStatus.WARN, f'no command: timed out, {safety.when_old}'
    if new['missed']:
        return DiagnosticStatus.WARN, f'{new["missed"]} deadlines missed in the last second'
    return DiagnosticStatus.OK, 'running' if torque else 'running, motors free'
