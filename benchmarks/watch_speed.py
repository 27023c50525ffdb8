# SPDX-License-Identifier: Apache-2.0
"""How fast the live page is: from a click to the redrawn curve, and to the first paint.

    PYTHONPATH=. python benchmarks/watch_speed.py [--robot pendulum] [--robot leo] [--turns 7]

Records 20 s of a robot with hidden friction (a pendulum that is driven by steps, LEO walking),
starts `leo watch`, opens the page in headless Chromium and uses it by hand. A time runs in the
browser, from the pointer's event to the frame after the error curve got its new data; of a
slider to the last of them. CPU, which other work on the machine hardly moves, is what the server
used until the curve was there (looked at every 20 ms) and until all parts of the page had
followed; of the first paint also what the browser used.
"""

from __future__ import annotations

import argparse
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
import json
import os
from pathlib import Path
import signal
from statistics import median
import subprocess
import sys
import tempfile
import time
from typing import Any, NamedTuple

import numpy as np
from selenium.webdriver import Chrome
from tests import browser

from leo_lab.blind.case import Case
from leo_lab.blind.excitation import excitation
from leo_lab.blind.open_loop import Run
from leo_lab.blind.record import record
from leo_lab.blind.scenes import Given, Step
from leo_learner.policy import Policy
from leo_sim.description.robot import load_robot, Robot
from leo_sim.effects import place
from leo_sim.task.task import Task

SECONDS, NOISE = 20.0, (1e-3, 0.05)
HIDDEN = {'pendulum': ('pivot', 1e-3), 'leo': ('left_knee', 0.05)}
GATES = {'pendulum': 0.3, 'leo': 1.5}
"""Of a change, as issue 27 asks for [s]."""
DRAGGED = {'pendulum': 'pointermove', 'leo': 'pointerup'}
"""What counts of the pointer on a slider: of a walker, that it is let go."""
FIRST_PAINT = 3.0
ASIDE = (40, -30, 25, -35)
"""How far the slider is dragged in turn [px]."""
NONE_COMES = 20.0
"""A curve that is not there after so long does not come [s]."""
SETTLED = 0.7
"""So long without a new curve, it is the last one [s]."""
WATCHED = """
const source = Bokeh.documents[0].get_model_by_name('error against horizon');
window.watched = {pointermove: 0, pointerup: 0, drawn: 0};
for (const kind of ['pointermove', 'pointerup'])
  window.addEventListener(kind, event => {
    if (event.buttons || kind == 'pointerup') watched[kind] = event.timeStamp}, true);
source.properties.data.change.connect(() => requestAnimationFrame(
  () => requestAnimationFrame(() => {watched.drawn = performance.now()})));
"""


class Walking:
    """LEO under the shipped policy, as a scene of a blind case.

    Args:
        robot: LEO.
    """

    start, held = 'nominal', False

    def __init__(self, robot: Robot) -> None:
        self._robot, self.count = robot, round(SECONDS / robot.control_period)

    def begin(self) -> Step:
        """What drives the robot."""
        policy, task = Policy.load('leo_walk'), Task(self._robot)
        on = np.ones(len(self._robot.actuators), dtype=bool)

        def step(_: int, q: np.ndarray, dq: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
            wanted = policy(task.observation(q, dq))
            return np.clip(wanted, -self._robot.limits, self._robot.limits), on

        return step


class Change(NamedTuple):
    """What one change took [s].

    Attributes:
        drawn: until the curve was there.
        cpu: of the server until then.
        followed: the same until all parts had followed.
    """

    drawn: float
    cpu: float
    followed: float


def recorded(name: str, folder: Path) -> Path:
    """A bag of a robot that hides friction."""
    robot, (where, size) = load_robot(name), HIDDEN[name]
    scene: Any = (
        Walking(robot) if robot.contacts else Given(*excitation(robot, np.random.default_rng(1)))
    )
    hidden = place(robot, 'coulomb_friction', where, c=size)
    run = Run(robot, (scene,), NOISE)
    return record(Case('effect', 1, robot, run, ('rigid', 0.0), (hidden,)), folder)[0]


@contextmanager
def watching(name: str, bag: Path) -> Iterator[tuple[str, int]]:
    """The running command: its address and its process."""
    told = ['leo', 'watch', str(bag), '--model', name, '--no-browser', '--json']
    with subprocess.Popen(told, stdout=subprocess.PIPE, text=True) as leo:
        try:
            assert leo.stdout is not None
            yield json.loads(leo.stdout.readline())['url'], leo.pid
        finally:
            end(leo)


def end(process: subprocess.Popen) -> None:
    """Interrupt it, and kill it where it does not hear."""
    process.send_signal(signal.SIGINT)
    try:
        process.wait(20)
    except subprocess.TimeoutExpired:
        process.kill()


def cpu(pid: int) -> float:
    """User and system time of a process so far [s]."""
    fields = Path(f'/proc/{pid}/stat').read_text().rpartition(')')[2].split()
    return (int(fields[11]) + int(fields[12])) / os.sysconf('SC_CLK_TCK')


def browser_cpu(driver: Chrome) -> float:
    """User and system time of the browser with all its processes [s]."""
    parents = {}
    for stat in Path('/proc').glob('[0-9]*/stat'):
        with suppress(OSError):
            parents[int(stat.parent.name)] = int(stat.read_text().rpartition(')')[2].split()[1])
    ours = {driver.service.process.pid}
    while more := {pid for pid, parent in parents.items() if parent in ours} - ours:
        ours |= more
    return sum(cpu(pid) for pid in ours if Path(f'/proc/{pid}').exists())


class Hand:
    """Does something on the page and tells what it took."""

    def __init__(self, driver: Chrome, page: browser.Page, pid: int) -> None:
        self._driver, self._page, self._pid = driver, page, pid
        self._rest()
        driver.execute_script(WATCHED)

    def change(self, act: Callable[[], None], event: str = 'pointerup') -> Change | None:
        """From the last event of the pointer that counts to the curve that stays, if one comes.

        An effect that cannot lower the error is switched on at none of it.
        """
        self._driver.execute_script('watched.drawn = 0')
        before, late = cpu(self._pid), time.monotonic() + NONE_COMES
        act()
        browser.until(
            lambda: self._at('drawn') > self._at(event) or time.monotonic() > late, 'a new curve'
        )
        if self._at('drawn') <= self._at(event):
            return None
        until = cpu(self._pid) - before
        self._rest()
        return Change(self._at('drawn') - self._at(event), until, cpu(self._pid) - before)

    def _rest(self) -> None:
        """Wait until all parts have followed and no new curve comes."""
        followed = time.monotonic()
        while time.monotonic() < followed + SETTLED:
            if 'computing' in self._page.text('where says'):
                followed = time.monotonic()
            time.sleep(0.1)

    def _at(self, what: str) -> float:
        """When the curve was drawn, or the last event of the pointer was [s]."""
        return 1e-3 * self._driver.execute_script('return watched[arguments[0]]', what)


def changes(
    hand: Hand, page: browser.Page, label: str, turns: int, dragged: str
) -> dict[str, list[Change]]:
    """Each kind of change, so many times; `dragged`: the event that counts on a slider."""
    found: dict[str, list[Change]] = {}

    def add(kind: str, act: Callable[[], None], event: str = 'pointerup') -> None:
        taken = hand.change(act, event)
        if taken is not None:
            found.setdefault(kind, []).append(taken)
        print(f'    {kind}: {_words([taken]) if taken else "no new curve"}', flush=True)

    add('switch on, first', lambda: page.click(f'switch {label}'))
    for turn in range(turns):
        aside = ASIDE[turn % len(ASIDE)]
        add('slider', lambda aside=aside: page.drag(f'slider {label} c', aside), dragged)
        add('undo', lambda: page.click('undo'))
        add('switch off', lambda: page.click(f'switch {label}'))
        add('switch on again', lambda: page.click(f'switch {label}'))
    for other in others(label):
        add('switch on, others', lambda other=other: page.click(f'switch {other}'))
        add('switch off', lambda other=other: page.click(f'switch {other}'))
    return found


def others(label: str) -> list[str]:
    """Effects at the same joint that are switched on beside it for the first time."""
    where = label.partition(':')[2]
    return [f'{name}:{where}' for name in ('viscous_friction', 'torque_scale')]


def measure(name: str, turns: int, folder: Path) -> None:
    """Record, open, use, print."""
    bag, label = recorded(name, folder / 'bag'), f'coulomb_friction:{HIDDEN[name][0]}'
    with browser.chromium(folder / 'profile') as driver:
        began = time.perf_counter()
        with watching(name, bag) as (url, pid):
            ready, used = time.perf_counter() - began, cpu(pid)
            opened, seen = time.perf_counter(), browser_cpu(driver)
            page = browser.Page(driver, url)
            painted = time.perf_counter() - opened
            print(
                f'{name}: the command is ready after {ready:.2f} s (CPU {used:.2f} s), the page '
                f'painted {painted:.2f} s after it is opened (CPU: server '
                f'{cpu(pid) - used:.2f} s, browser {browser_cpu(driver) - seen:.2f} s; gate '
                f'{FIRST_PAINT:g} s)',
                flush=True,
            )
            again = time.perf_counter()
            browser.Page(driver, url)
            print(f'  opened again: {time.perf_counter() - again:.2f} s', flush=True)
            found = changes(Hand(driver, page, pid), page, label, turns, DRAGGED[name])
    for kind, taken in found.items():
        print(f'  {kind:18} {_words(taken)}', flush=True)
    everything = [change for taken in found.values() for change in taken]
    print(f'  {"all":18} {_words(everything)}; gate {GATES[name]:g} s median', flush=True)


def _words(taken: list[Change]) -> str:
    drawn, used, followed = zip(*taken, strict=True)
    return (
        f'{len(taken):3} times: redrawn after {median(drawn):.2f} s, at most {max(drawn):.2f};'
        f' CPU until then {median(used):.2f} s, at most {max(used):.2f}; until all '
        f'followed {median(followed):.2f} s'
    )


def main() -> int:
    """Measure and print."""
    parser = argparse.ArgumentParser(description=(__doc__ or '').split('\n')[0])
    parser.add_argument('--robot', choices=[*HIDDEN], action='append')
    parser.add_argument('--turns', type=int, default=7)
    arguments = parser.parse_args()
    for name in arguments.robot or HIDDEN:
        with tempfile.TemporaryDirectory() as folder:
            measure(name, arguments.turns, Path(folder))
        print(f'  load of the machine: {os.getloadavg()[0]:.1f} on {os.cpu_count()} cores')
    return 0


if __name__ == '__main__':
    sys.exit(main())
