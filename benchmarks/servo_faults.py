# SPDX-License-Identifier: Apache-2.0
"""How long the motors behind the emulated bus are driven after something goes wrong.

    python benchmarks/servo_faults.py [-n 20] [--results FILE] [KIND ...]
    python benchmarks/servo_faults.py --goals [-n 20] [--results FILE] [KIND ...]

LEO hangs and is commanded 2 V at 50 Hz; at a random moment the fault comes. The time is from the
fault to the first moment at which every motor is at 0 V or free, in the bus's own record of what
is on the motors, on one clock. Commands go on unless the fault is that they end. The slowest case
of each kind is told apart: how long the emulated bus itself was kept waiting in it; of an e-stop
when this process had sent it and when the node had carried it out, and how long a thread of the
node was ready to run but had to wait until this process had its answer. With --results each case
is kept in a file, one line each; started again, it goes on there.

With --goals it is SO-101, sent to and fro between goals far beyond its limits: what counts is when
no goal changed any more, or the motors were free, and how far and how fast goals went.
"""

from __future__ import annotations

import argparse
from collections.abc import Callable
import os
from pathlib import Path
import random
import re
import signal
import time
from typing import Any

from emulated import Emulated, emulated, PATIENCE, real_time
from goals_seen import beyond, fastest, last_change
import numpy as np
from rcl_interfaces.srv import SetParameters
from rclpy.node import Node
from rclpy.parameter import Parameter

from leo_lab.result_lines import append_result, read_results
from leo_msgs_py import topics
from leo_msgs_py.node import call, join, spin_once, spin_until
from leo_msgs_py.values import command_message
from leo_sim.description.robot import load_robot

VOLTS = 2.0
SLEW, PERIOD = 2.0, 0.02  # of the goals [rad/s]; of SO-101 [s]
WATCHED, BLOCKED_FOR = 1.5, 0.9
"""How long goals are watched after a fault, and after a reading that will end [s]."""
BUS_LOSS = (0.01, 0.1, 0.5)
BLOCKED = 'read blocked for 1 s'
BLOCKING = str(Path(__file__).with_name('blocking.py'))
ENDED = 1, -signal.SIGKILL
"""Exit status of a node that a fault has ended."""


class Bench(Node):
    """A commander that counts.

    Args:
        leo: the bus, and the robot that is started on it.
    """

    interface = 'voltage'
    more: tuple[str, ...] = ()  # parameters of the robot node
    heading = 'largest |V|'

    def __init__(self, leo: Emulated) -> None:
        super().__init__('bench')
        self.leo = leo
        kind, name, qos = topics.COMMANDS[self.interface]
        self._commands = self.create_publisher(kind, name, qos)
        self._set = self.create_client(SetParameters, '/servo_bus/set_parameters')
        self._stop = self.create_client(*topics.E_STOP)
        self._unstop = self.create_client(*topics.E_STOP_RESET)
        self.talks = True
        self.sent = 0.0
        self.asked: float | None = None
        self.create_timer(0.02, self._command)

    def ready(self) -> None:
        """A robot that runs, all cables in, every motor driven."""
        self.set(bus_cable=True, usb_cable=True, silent=-1, lose=0.0)
        assert spin_until(self.leo.port.is_symlink, PATIENCE)
        self.talks, self.asked = True, None
        spin_until(lambda: False, 0.2)  # one that ends now has ended
        deadline = time.monotonic() + PATIENCE
        while not (self._released() and spin_until(self.driven, 3.0)):
            assert time.monotonic() < deadline, self.leo.said()[-2000:]

    def set(self, **values: object) -> None:
        """Set parameters of the bus."""
        asked = [Parameter(n, value=v).to_parameter_msg() for n, v in values.items()]
        call(self._set, SetParameters.Request(parameters=asked), PATIENCE)

    def with_driver(self, driver: str) -> None:
        """End a robot that runs with another driver; `ready` starts it."""
        if self.leo.driver != driver and self.leo.runs('robot'):
            self.leo.stop('robot')
        self.leo.driver = driver

    def e_stop(self) -> None:
        """Call it, and wait for the answer as long as there is a node that may give one."""
        future = self._stop.call_async(topics.E_STOP.type.Request())
        self.asked = time.monotonic()
        if not spin_until(future.done, 2.0):
            assert self.leo.processes['robot'].poll() in ENDED, self.leo.said()[-2000:]

    def driven(self) -> bool:
        """Whether every motor is driven."""
        return self.leo.driven(VOLTS)

    def figures(self, began: float) -> dict[str, float]:
        """What else the motors saw."""
        return {'largest_v': round(self.leo.largest_since(began - 1.0), 4)}

    def told(self, cases: list[dict[str, Any]]) -> str:
        """The worst of those figures."""
        return f'{max(case["largest_v"] for case in cases):13.3f}'

    def stopped_after(self, kind: str, began: float) -> float:
        """Time [s] from `began` until all motors were at 0 or free, and stayed so.

        Whatever the kind of fault.
        """
        deadline = time.monotonic() + 5.0
        while time.monotonic() < deadline:
            spin_once(0.02)
            rows = self.leo.moments()
            if rows and not np.nan_to_num(rows[-1][1]).any() and rows[-1][0] > began - 0.02:
                break
        driven = [k for k, (_, volts) in enumerate(rows) if np.nan_to_num(volts).any()]
        last = driven[-1]
        return max(0.0, rows[last + 1][0] - began) if last + 1 < len(rows) else np.inf

    def answered(self, began: float) -> float | None:
        """When the node had carried out the e-stop, after `began` [s]; None where it did not.

        Its log goes by the clock on the wall.
        """
        offset = time.time() - time.monotonic()
        said = re.findall(r'\[([0-9.]+)\] \[robot_?\w*\]: e-stop: ', self.leo.said('robot'))
        return next(
            (
                float(t) - offset - began
                for t in reversed(said)
                if float(t) - offset > began - 1e-3
            ),
            None,
        )

    def _released(self) -> bool:
        self.leo.start_robot(*self.more)
        try:
            call(self._unstop, topics.E_STOP_RESET.type.Request(), 1.0)
        except TimeoutError:  # the one that answered before was killed
            return False
        return True

    def _command(self) -> None:
        if self.talks:
            self._commands.publish(command_message(self.wanted()))
            self.sent = time.monotonic()

    def wanted(self) -> list[float]:
        """What is commanded."""
        return [VOLTS] * 6


class GoalBench(Bench):
    """One that sends each joint to and fro, to goals beyond its limits."""

    interface = 'position'
    more = (f'slew:={SLEW}',)
    heading = f'beyond its limits [rad], fastest [rad/s] of {SLEW:g}, largest step [rad]'

    def __init__(self, leo: Emulated) -> None:
        super().__init__(leo)
        self._bounds = load_robot(leo.robot).bounds
        self._goals, self._until = np.zeros(6), np.zeros(6)

    def driven(self) -> bool:
        """Whether every motor has a goal."""
        rows = self.leo.moments()
        return bool(rows) and bool(np.isfinite(rows[-1][1]).all())

    def wanted(self) -> list[float]:
        """Another goal for a joint now and then."""
        over = time.monotonic() > self._until
        self._goals = np.where(over, np.random.uniform(-4.0, 4.0, 6), self._goals)
        ahead = time.monotonic() + np.random.uniform(0.2, 2.0, 6)
        self._until = np.where(over, ahead, self._until)
        return [float(goal) for goal in self._goals]

    def stopped_after(self, kind: str, began: float) -> float:
        """Time [s] from `began` until no goal changed any more and no motor was freed."""
        watched = BLOCKED_FOR if kind == BLOCKED else WATCHED
        spin_until(lambda: False, max(0.0, began + watched - time.monotonic()))
        return max(0.0, last_change(self.leo.moments(), began + watched) - began)

    def figures(self, began: float) -> dict[str, float]:
        """How far and how fast the goals went since a second before."""
        rows = [row for row in self.leo.moments() if row[0] > began - 1.0]
        rate, step = fastest(rows, PERIOD)
        free = int(np.isnan(rows[-1][1]).sum()) if rows else -1
        return {
            'beyond': round(beyond(rows, self._bounds), 5),
            'fastest': round(rate, 4),
            'step': round(step, 5),
            'free': free,
        }

    def told(self, cases: list[dict[str, Any]]) -> str:
        """The worst of those figures, and how many motors were free in the end."""
        worst = (max(case[key] for case in cases) for key in ('beyond', 'fastest', 'step'))
        free = sorted({case['free'] for case in cases})
        return ''.join(f'{value:9.4f}' for value in worst) + f'  free {free}'


def e_stop(bench: Bench) -> float:
    """The service is called; a node that has ended by itself has stopped before."""
    began = time.monotonic()
    bench.e_stop()
    return began


def no_command(bench: Bench) -> float:
    """Commands end; the time-out of 0.2 s is taken off."""
    bench.talks = False
    return bench.sent + 0.2


def killed(bench: Bench) -> float:
    """Kill -9."""
    bench.leo.processes['robot'].send_signal(signal.SIGKILL)
    return time.monotonic()


def breaking(**values: object) -> Callable[[Bench], float]:
    """A parameter of the bus is set."""

    def act(bench: Bench) -> float:
        began = time.monotonic()
        bench.set(**values)
        return began

    return act


def blocked(bench: Bench) -> float:
    """The next reading takes a second; a node that has ended by itself has stopped before."""
    told = bench.leo.folder / 'blocked'
    told.unlink(missing_ok=True)
    (bench.leo.folder / 'block').touch()
    if spin_until(lambda: told.exists() and bool(told.read_text()), 2.0):
        return float(told.read_text())
    assert bench.leo.processes['robot'].poll() in ENDED, bench.leo.said()[-2000:]
    (bench.leo.folder / 'block').unlink()
    return time.monotonic()


def stopped_during(
    fault: Callable[[Bench], float], least: float = 0.0, most: float = 0.03
) -> Callable[[Bench], float]:
    """An e-stop so many seconds after another fault, while the motors may still be driven."""

    def act(bench: Bench) -> float:
        fault(bench)
        spin_until(lambda: False, random.uniform(least, most))
        return e_stop(bench)

    return act


LOSSY = {f'{share:.0%} lost': breaking(lose=share) for share in BUS_LOSS}
"""What voltages are measured without: a lost packet is 0 V."""
HURT = {
    'kill -9': killed,
    'bus cable out': breaking(bus_cable=False),
    'usb cable out': breaking(usb_cable=False),
    'servo 3 silent': breaking(silent=3),
    BLOCKED: blocked,
}
KINDS: dict[str, Callable[[Bench], float]] = {
    'e-stop': e_stop,
    'no command': no_command,
    **HURT,
    **LOSSY,
    **{f'e-stop, {name}': stopped_during(fault, 0.05, 0.1) for name, fault in LOSSY.items()},
    **{f'e-stop, {name}': stopped_during(fault) for name, fault in HURT.items()},
}


def main() -> None:
    """Measure and print."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument('kinds', nargs='*', help=', '.join(KINDS).replace('%', '%%'))
    parser.add_argument('-n', type=int, default=20)
    parser.add_argument('--results', type=Path, help='file of cases, gone on with')
    parser.add_argument('--goals', action='store_true', help='an arm that follows goals')
    options = parser.parse_args()
    real_time(os.getpid())
    kinds = options.kinds or [k for k in KINDS if options.goals or k not in LOSSY]
    robot, start = ('so101', 'nominal') if options.goals else ('leo', 'hanging')
    with emulated(start, robot=robot) as leo:
        bench = join(GoalBench(leo) if options.goals else Bench(leo))
        report(bench, kinds, options.n, options.results)


def report(bench: Bench, kinds: list[str], count: int, results: Path | None) -> None:
    """Each kind so many times."""
    print(
        f'{"":28}{"n":>5}{"median":>8}{"p90":>7}{"p99":>7}{"max [ms]":>10}  {bench.heading}'
        '  of the slowest: bus waited, e-stop sent, carried out, node waited [ms]',
        flush=True,
    )
    done = read_results(results) if results else []
    for kind in kinds:
        cases = [case for case in done if case['kind'] == kind]
        while len(cases) < count:
            cases.append(measured(bench, kind))
            if results:
                append_result(results, cases[-1])
        print_row(bench, kind, cases)
        print(f'tracebacks: {sum(case["traceback"] for case in cases)}')


def measured(bench: Bench, kind: str) -> dict[str, Any]:
    """One case: ms until the motors were stopped, and what tells why it took so long."""
    bench.with_driver(BLOCKING if BLOCKED in kind else bench.leo.family)
    bench.ready()
    spin_until(lambda: False, random.uniform(0.05, 0.3))
    waits = bench.leo.kept_waiting('robot')
    began = KINDS[kind](bench)
    now = bench.leo.kept_waiting('robot')
    after = bench.stopped_after(kind, began)
    answered = bench.answered(began)
    return {
        'kind': kind,
        'ms': round(1e3 * after, 2),
        'robot_waited_ms': round(
            1e3 * max((now[t] - waits[t] for t in waits.keys() & now.keys()), default=0.0), 2
        ),
        'bus_waited_ms': round(1e3 * bench.leo.waited(began), 2),
        'sent_ms': None if bench.asked is None else round(1e3 * (bench.asked - began), 2),
        'answered_ms': None if answered is None else round(1e3 * answered, 2),
        **bench.figures(began),
        'traceback': 'Traceback' in bench.leo.said(),
    }


def print_row(bench: Bench, kind: str, cases: list[dict[str, Any]]) -> None:
    """The figures of a kind."""
    times = [case['ms'] for case in cases]
    middle, *most = np.percentile(times, (50, 90, 99))
    worst = max(cases, key=lambda case: float(case['ms']))
    told = ', '.join(
        '-' if worst.get(key) is None else f'{worst[key]:.1f}'
        for key in ('bus_waited_ms', 'sent_ms', 'answered_ms', 'robot_waited_ms')
    )
    print(
        f'{kind:28}{len(cases):>5}{middle:8.1f}{most[0]:7.1f}{most[1]:7.1f}{max(times):10.1f}'
        f'{bench.told(cases)}  {told}',
        flush=True,
    )


if __name__ == '__main__':
    main()
