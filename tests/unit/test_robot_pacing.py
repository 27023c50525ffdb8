# SPDX-License-Identifier: Apache-2.0
"""How a robot's time passes, with a robot that only writes down what is asked of it."""

import pytest

from leo_sim.nodes import pacing
from leo_sim.nodes.pacing import ACKNOWLEDGE_TIMEOUT, REPEAT_PERIOD, run_lockstep, run_realtime


class Clock:
    """A clock that moves only while somebody sleeps."""

    def __init__(self):
        self.now = 0.0

    def monotonic(self):
        return self.now

    def sleep(self, seconds):
        self.now += seconds


time = Clock()


@pytest.fixture(autouse=True)
def _our_clock(monkeypatch):
    monkeypatch.setattr(pacing, 'time', time)


class Notes:
    """A robot node of 3 states per command; `script` says what comes in at each spin."""

    states_per_command = 3

    def __init__(self, script=(), period=0.01):
        self.calls, self.script, self.commanded = [], list(script), False
        self.period, self.lateness, self.slow_at, self.stuck = period, [], None, False

    def ok(self):
        return not self.calls or self.calls[-1] != 'end'

    def publish_state(self):
        self.calls.append('state')

    def repeat_state(self):
        self.calls.append('repeat')

    def apply(self):
        self.calls.append('apply')

    def advance(self):
        if len(self.lateness) == self.slow_at:
            time.sleep(5 * self.period)
        self.calls.append('advance')
        return self.period

    def spin_once(self, timeout):
        event = self.script.pop(0) if self.script else 'end'
        if event == 'nothing':
            time.sleep(timeout)
        elif event == 'command':
            self.commanded = True
        elif event == 'end':
            self.calls.append('end')

    def acknowledged(self, timeout):
        self.calls.append('acknowledged?')
        if self.stuck:
            time.sleep(timeout)
        return not self.stuck

    def warn(self, text):
        self.calls.append(text)

    def report(self, loop_time, lateness):
        self.lateness.append(lateness)


ONE_COMMAND = [*3 * ['apply', 'advance', 'state'], 'acknowledged?']


def test_lockstep_moves_one_control_period_per_command():
    robot = Notes(['command', 'nothing', 'command', 'nothing', 'end'])
    run_lockstep(robot, robot.ok)
    assert robot.calls == ['state', *ONE_COMMAND, *ONE_COMMAND, 'end']


def test_lockstep_drops_a_command_that_came_before_its_state():
    robot = Notes(['command', 'command', 'end'])
    run_lockstep(robot, robot.ok)
    assert robot.calls == ['state', *ONE_COMMAND, 'end'], 'the second answers a repeated state'


def test_lockstep_repeats_its_state_while_it_waits():
    robot = Notes(['nothing', 'nothing', 'command', 'nothing', 'end'])
    began = time.monotonic()
    run_lockstep(robot, robot.ok)
    assert robot.calls[:3] == ['state', 'repeat', 'repeat']
    assert time.monotonic() - began >= 2 * REPEAT_PERIOD


def test_lockstep_goes_on_without_a_reader_that_takes_nothing():
    robot = Notes(['command', *99 * ['nothing'], 'end'])
    robot.stuck = True
    began = time.monotonic()
    run_lockstep(robot, robot.ok)
    asked = robot.calls.count('acknowledged?')
    assert asked == pytest.approx(ACKNOWLEDGE_TIMEOUT / REPEAT_PERIOD, abs=1.5)
    assert robot.calls.count('a reader took nothing for 12 s: going on without it') == 1
    assert robot.calls[-1] == 'end' and time.monotonic() - began > ACKNOWLEDGE_TIMEOUT


class Timed(Notes):
    """Ends after `states` states."""

    def __init__(self, states, **options):
        super().__init__(**options)
        self.states = states

    def ok(self):
        return len(self.lateness) < self.states

    def spin_once(self, timeout):
        time.sleep(timeout)


def test_realtime_keeps_the_pace_and_catches_up():
    robot = Timed(20)
    robot.slow_at = 5
    began = time.monotonic()
    run_realtime(robot, robot.ok, factor=2.0)
    took = time.monotonic() - began
    assert took == pytest.approx(0.1), 'twenty states of 10 ms at twice real time'
    assert max(robot.lateness) == pytest.approx(0.045), 'the slow state was noticed'
    assert robot.calls[:2] == ['state', 'apply']
    assert robot.calls.count('state') == robot.calls.count('apply') == 21
