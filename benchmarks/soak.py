# SPDX-License-Identifier: Apache-2.0
"""LEO on the emulated bus at 100 Hz for an hour, commanded and recorded: what is lost, what grows.

    python benchmarks/soak.py [--minutes 60] [-o FOLDER]

LEO hangs and swings by sines of up to 3 V at 33 Hz. Servos and node bear stalls of a second: this
machine is not what is measured. Each minute one line goes to FOLDER/minutes.jsonl; started again
it does the minutes that are left, into a further bag.
"""

from __future__ import annotations

import argparse
from pathlib import Path
import re
import time
from typing import Any

from emulated import Emulated, emulated, PATIENCE
from mcap.records import Channel, Message
import numpy as np
from rclpy.node import Node

from leo_diffmodel.bags.recorder import header_stamp
from leo_lab.result_lines import append_result, read_results
from leo_msgs_py import topics
from leo_msgs_py.mcap_file import find_files, McapFile
from leo_msgs_py.node import join, running, spin_until
from leo_msgs_py.values import command_message

VOLTS, PERIOD, STATE = 3.0, 0.03, 0.01
PROCESSES = 'robot', 'recorder', 'servo_bus'
WARM = 5
"""Minutes after which memory should stay."""


class Swing(Node):
    """Commands sines, each motor with its own frequency."""

    def __init__(self) -> None:
        super().__init__('swing')
        kind, name, qos = topics.COMMANDS['voltage']
        self._commands = self.create_publisher(kind, name, qos)
        self._speeds = np.linspace(3.0, 9.0, 6)
        self.create_timer(PERIOD, self._command)

    def _command(self) -> None:
        values = VOLTS * np.sin(self._speeds * time.monotonic())
        self._commands.publish(command_message(values.tolist()))


def main() -> int:
    """Run and print."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument('--minutes', type=int, default=60)
    parser.add_argument('-o', '--output', type=Path, default=Path('soak'))
    options = parser.parse_args()
    options.output.mkdir(parents=True, exist_ok=True)
    lines = options.output / 'minutes.jsonl'
    done = len(read_results(lines))
    if done < options.minutes:
        with emulated(watchdog=2.0) as leo:
            part = options.output.resolve() / f'from_{done}'
            soaked(leo, part, options.minutes - done, lines)
    return report(options.output)


def soaked(leo: Emulated, bag: Path, minutes: int, lines: Path) -> None:
    """So many minutes into a bag."""
    leo.start('recorder', 'bag', 'record', '-o', str(bag))
    assert spin_until(lambda: leo.said('recorder'), PATIENCE)  # it is up
    join(Swing())
    while not spin_until(lambda: leo.driven(0.1) and leo.runs('robot'), 10.0):
        leo.start_robot('fault_periods:=100')  # one that a stall ended while it began
    for _ in range(minutes):
        spin_until(lambda: not running(), 60.0)
        if not running() or not all(map(leo.runs, PROCESSES)):
            break
        row = {name: round(leo.memory(name), 2) for name in PROCESSES}
        append_result(lines, {'at': round(time.time(), 1), **row})
    status = leo.stop('robot')
    bag.with_suffix('.txt').write_text(leo.said('robot'))
    leo.stop('recorder')
    assert status == 0, leo.said('robot')[-1000:]


def states(bag: Path) -> tuple[np.ndarray, np.ndarray]:
    """Stamps of the states in a bag [s], from its first, and their publisher's numbers of them."""
    records = [r for file in find_files(bag) for r in McapFile(file).records()]
    channel = next(r.id for r in records if isinstance(r, Channel) and r.topic == '/joint_states')
    found = [r for r in records if isinstance(r, Message) and r.channel_id == channel]
    times = np.array([header_stamp(m.data) for m in found])
    return np.sort(times - times.min()) * 1e-9, np.array([m.sequence for m in found])


def report(folder: Path) -> int:
    """What the bags and the log say; 1 if a state is missing."""
    missing = 0
    for said in sorted(folder.glob('from_*.txt')):
        text, (times, numbers) = said.read_text(), states(said.with_suffix(''))
        sent = int(re.findall(r'(\d+) states sent', text)[0])
        before = int(numbers.min()) - 1
        faults = ['0', *re.findall(r'\((\d+) so far\)', text)]
        gaps = 1e3 * np.diff(times)
        jitter = np.percentile(np.abs(gaps - 1e3 * STATE), (50, 99, 99.9))
        lost = sent - before - np.unique(numbers).size
        missing += lost
        print(
            f'{said.stem}: {times[-1] / 60:.1f} min, {sent} states sent, {before} before the '
            f'recorder had found the robot, {times.size} in the bag, {lost} missing; '
            f'{faults[-1]} periods without one; '
            f'{np.count_nonzero(gaps > 1.5e3 * STATE)} gaps above 15 ms, the longest '
            f'{gaps.max():.1f} ms; |period - 10 ms| median '
            f'{jitter[0]:.3f}, p99 {jitter[1]:.3f}, p99.9 {jitter[2]:.3f} ms'
        )
    print_memory(read_results(folder / 'minutes.jsonl'))
    return int(missing > 0)


def print_memory(rows: list[dict[str, Any]]) -> None:
    """Memory of each process at first, when warm, and at the end."""
    warm = rows[min(WARM, len(rows)) - 1]
    for name in PROCESSES:
        first, last = rows[0][name], rows[-1][name]
        print(
            f'{name}: {first} MB after a minute, {warm[name]} after {min(WARM, len(rows))}, '
            f'{last} after {len(rows)} ({100 * (last / warm[name] - 1):+.1f} %)'
        )


if __name__ == '__main__':
    raise SystemExit(main())
