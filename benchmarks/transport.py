# SPDX-License-Identifier: Apache-2.0
"""Messages between processes and lockstep with a recorder, beside those of another checkout.

    git worktree add ../before 41d7e69 && ../before/run_all.sh setup
    python benchmarks/transport.py --against ../before --rounds 5

Each round measures both, one after the other, in turns; the table has medians over the rounds and
their ratio. Without --against only this checkout is measured.
"""

from __future__ import annotations

import argparse
from collections.abc import Iterator
from contextlib import contextmanager
import json
import os
from pathlib import Path
import random
import signal
import statistics
import subprocess
import tempfile
import time

ROOT = Path(__file__).resolve().parents[1]
PEER = Path(__file__).with_name('transport_peer.py')
TRIPS, PERIODS = 2000, 600
TICKS = os.sysconf('SC_CLK_TCK')
Figures = dict[str, float]


def main() -> int:
    """Measure and print."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument('--against', type=Path, help='another checkout with its .venv')
    parser.add_argument('--rounds', type=int, default=3)
    parser.add_argument('--json', action='store_true', help='print JSON')
    options = parser.parse_args()
    checkouts = {'here': ROOT}
    if options.against:
        checkouts['there'] = options.against.resolve()
    found: dict[str, list[Figures]] = {name: [] for name in checkouts}
    for number in range(options.rounds):
        for name in sorted(checkouts, reverse=bool(number % 2)):
            found[name].append(measure(checkouts[name]))
    medians = {
        name: {key: statistics.median(row[key] for row in rows) for key in rows[0]}
        for name, rows in found.items()
    }
    print(json.dumps(medians) if options.json else table(medians))
    return 0


def measure(checkout: Path) -> Figures:
    """All figures of one checkout, once."""
    with tempfile.TemporaryDirectory() as folder:
        bench = Bench(checkout, Path(folder))
        return bench.trips() | bench.start() | bench.lockstep()


class Bench:
    """Processes of one checkout in a domain of their own."""

    def __init__(self, checkout: Path, folder: Path) -> None:
        self._bin, self._folder = checkout / '.venv' / 'bin', folder
        self._environment = os.environ | {
            'ROS_DOMAIN_ID': str(random.randint(101, 200)),
            'XDG_RUNTIME_DIR': str(folder),
        }

    def trips(self) -> Figures:
        """Round trips of a JointState with six joints."""
        with self._process('python', PEER, 'echo', '0'):
            return self._ask('trips', TRIPS)

    def start(self) -> Figures:
        """From starting a robot node to its first state in another process."""
        with self._process('python', PEER, 'first', '0', pipe=True) as listener:
            assert listener.stdout is not None
            listener.stdout.readline()
            began = time.time()
            with self._robot():
                heard = json.loads(listener.stdout.readline())['at']
        return {'node start to first state [s]': heard - began}

    def lockstep(self) -> Figures:
        """A robot, a recorder and a commander in lockstep."""
        words = 'leo_diffmodel', 'diffmodel', '--ros-args', '-p', f'bag:={self._folder / "bag"}'
        with self._robot() as robot, self._process('leo', 'run', *words) as recorder:
            time.sleep(5.0)
            before = cpu(robot) + cpu(recorder)
            figures = self._ask('drive', PERIODS)
            used = cpu(robot) + cpu(recorder) - before
        states = PERIODS * 5
        return figures | {'robot and recorder CPU per state [us]': 1e6 * used / states}

    def _robot(self) -> contextmanager:
        words = '-p', 'robot:=pendulum', '-p', 'realtime_factor:=0'
        return self._process('leo', 'run', 'leo_sim', 'robot', '--ros-args', *words)

    def _ask(self, role: str, count: int) -> Figures:
        done = subprocess.run(
            [self._bin / 'python', PEER, role, str(count)],
            env=self._environment,
            capture_output=True,
            text=True,
            check=True,
        )
        return json.loads(done.stdout.splitlines()[-1])

    @contextmanager
    def _process(
        self, program: str, *words: str | Path, pipe: bool = False
    ) -> Iterator[subprocess.Popen[str]]:
        out = subprocess.PIPE if pipe else subprocess.DEVNULL
        process = subprocess.Popen(
            [self._bin / program, *words],
            env=self._environment,
            cwd=self._folder,
            stdout=out,
            stderr=subprocess.DEVNULL,
            text=True,
        )
        try:
            yield process
        finally:
            process.send_signal(signal.SIGINT)
            process.wait(30)


def cpu(process: subprocess.Popen[str]) -> float:
    """CPU time of a process so far [s]."""
    fields = Path(f'/proc/{process.pid}/stat').read_text().rpartition(')')[2].split()
    return (int(fields[11]) + int(fields[12])) / TICKS


def table(medians: dict[str, Figures]) -> str:
    """Figures of both checkouts and their ratio."""
    lines = [f'{"":40} {"here":>9} {"there":>9} {"ratio":>7}']
    for name, value in medians['here'].items():
        other = medians.get('there', {}).get(name)
        beside = '' if other is None else f' {other:9.3g} {value / other:7.2f}'
        lines.append(f'{name:40} {value:9.3g}{beside}')
    return '\n'.join(lines)


if __name__ == '__main__':
    raise SystemExit(main())
