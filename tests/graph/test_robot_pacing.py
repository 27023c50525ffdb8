# SPDX-License-Identifier: Apache-2.0
"""How a robot's time passes, with a driver that only writes down what is asked of it."""

from collections.abc import Iterator
from contextlib import contextmanager
import gc

import numpy as np
import pytest
from tests.drivers.clock import Clock
from tests.patience import PATIENCE

from leo_msgs_py import topics
from leo_msgs_py.errors import UserError
from leo_msgs_py.node import end, graph, join, spin_until
from leo_msgs_py.values import Applied, command_message, JointStates
from leo_sim.drivers.base import DriverInfo
from leo_sim.nodes import loop, publishers
from leo_sim.nodes import robot as module
from leo_sim.nodes.loop import GIVE_UP_LATE
from leo_sim.nodes.robot import RobotNode

pytestmark = pytest.mark.graph
PERIOD = 0.01
JOINTS = ('pivot',)
ONE_COMMAND = 3 * ['write', 'advance', 'read']


class Driver:
    """A robot of 3 states per command that stands still; `act` is done as it advances."""

    info = DriverInfo(JOINTS, JOINTS, 'voltage', np.ones(1), 3 * PERIOD, 1 / PERIOD, '', True)

    def __init__(self):
        self.calls, self.starts, self.count, self.act = [], 0, 0, lambda: None

    def connect(self):
        self.starts = 1

    def read(self):
        self.calls.append('read')
        return JointStates(round(self.count * PERIOD * 1e9), JOINTS, np.zeros(1), np.zeros(1))

    def write(self, values):
        self.calls.append('write')
        return Applied(round(self.count * PERIOD * 1e9), JOINTS, values)

    def advance(self, seconds):
        self.calls.append('advance')
        self.count += 1
        self.act()
        return seconds

    def stop(self):
        self.calls.append('stop')


@pytest.fixture
def driver(domain, monkeypatch, tmp_path):
    made = Driver()
    monkeypatch.setenv('XDG_RUNTIME_DIR', str(tmp_path))
    monkeypatch.setattr(module, 'load_driver', lambda name, options: made)
    return made


@contextmanager
def begun(factor: float) -> Iterator[RobotNode]:
    """A robot node at its first state."""
    words = '--ros-args', '--log-level', 'error', '-p', f'realtime_factor:={factor}'
    with graph([*words]):
        robot = RobotNode()
        robot.begin()
        yield robot


def test_a_robot_given_what_it_has_not_calls_no_driver(driver):
    with graph(['--ros-args', '-p', 'robt:=servo_pendulum']):
        said = "^robot has no parameter 'robt'; did you mean robot[?]$"
        with pytest.raises(UserError, match=said):
            RobotNode()
    assert driver.calls == [] and driver.starts == 0


@pytest.fixture
def robot(driver):
    with begun(0.0) as made:
        yield join(made)


@pytest.fixture
def commands(robot):
    made = robot.create_publisher(*topics.COMMANDS['voltage'])
    assert spin_until(lambda: made.get_subscription_count() > 0, PATIENCE)
    return made


VOLT = command_message([1.0])


def test_lockstep_moves_one_control_period_per_command(robot, driver, commands):
    for count in (1, 2):
        commands.publish(VOLT)
        assert spin_until(lambda n=count: driver.calls.count('read') > 3 * n, PATIENCE)
    spin_until(lambda: False, 0.05)
    assert driver.calls == ['read', *ONE_COMMAND, *ONE_COMMAND]


def test_lockstep_drops_a_command_that_came_before_its_state(robot, driver, commands):
    driver.act = lambda: driver.count == 1 and commands.publish(VOLT)
    commands.publish(VOLT)
    assert spin_until(lambda: driver.calls.count('read') > 3, PATIENCE)
    spin_until(lambda: False, 0.3)
    assert driver.calls == ['read', *ONE_COMMAND], 'the second answers a repeated state'


def test_lockstep_repeats_its_state_and_its_clock_while_it_waits(robot, driver):
    heard, clocks = [], []
    robot.create_subscription(*topics.JOINT_STATES[:2], heard.append, topics.LOSSLESS)
    robot.create_subscription(*topics.CLOCK[:2], clocks.append, topics.CLOCK.qos)
    assert spin_until(lambda: len(heard) >= 3 and len(clocks) >= 3, PATIENCE)
    assert {state.header.stamp.nanosec for state in heard} == {0}
    assert driver.calls == ['read']


class Full:
    """A publisher whose reader takes nothing while `stuck`."""

    topic_name = '/joint_states'

    def __init__(self):
        self.stuck, self.refused, self.published = True, 0, 0

    def publish(self, message):
        if self.stuck:
            self.refused += 1
            raise RuntimeError('no room')
        self.published += 1


def test_lockstep_waits_for_a_reader_but_not_for_ever(robot, monkeypatch):
    monkeypatch.setattr(publishers, 'time', Hasty())
    full = robot._topics.states = Full()
    repeat = robot._loop.repeat_state
    repeat()
    asked, full.refused = full.refused, 0
    assert asked == pytest.approx(publishers.PATIENCE, abs=1.5)
    repeat()
    assert full.refused == 1, 'once given up, it asks and goes on'
    full.stuck = False
    repeat()
    full.stuck, full.refused = True, 0
    repeat()
    assert (full.published, full.refused) == (1, asked), 'it is waited for again'


class Hasty(Clock):
    def monotonic(self):
        self.sleep(1.0)
        return super().monotonic()


def test_what_is_counted_as_sent_was_published(robot):
    sending, sent = robot._loop, Full()
    sending.topics.states, sent.stuck, before = sent, False, sending.sent
    end()
    sending.publish_state()
    assert sent.published == sending.sent - before == 1
    sent.stuck = True
    sending.publish_state()  # a reader that takes nothing does not keep it from ending


def test_the_collector_leaves_alone_what_was_there_before_the_loop(driver):
    frozen = []

    def act() -> None:
        frozen.append(gc.get_freeze_count())
        end()

    driver.act = act
    gc.unfreeze()
    with begun(factor=2.0) as robot:
        robot.run()
    gc.unfreeze()
    assert frozen[0] > 10_000


@pytest.mark.parametrize(('slow', 'lost'), [(0.05, 0.0), (10.0, 9.995)])
def test_realtime_keeps_the_pace_and_catches_up(driver, monkeypatch, slow, lost):
    """One state of 21 takes `slow` seconds; what is far too late is not caught up."""
    clock, lateness = Clock(), []
    for timed in (module, loop):
        monkeypatch.setattr(timed, 'time', clock)
    monkeypatch.setattr(module.node, 'spin_once', clock.sleep)

    def act() -> None:
        clock.sleep(slow if driver.count == 6 else 0.0)
        if driver.count == 21:
            end()

    driver.act = act
    with begun(factor=2.0) as robot:
        monkeypatch.setattr(robot._loop.health, 'note', lambda _, late: lateness.append(late))
        robot.run()
    assert clock.monotonic() == pytest.approx(PERIOD + 20 * PERIOD / 2 + lost), 'twice real time'
    assert max(lateness) == pytest.approx(slow - PERIOD / 2), 'the slow state was noticed'
    assert (max(lateness) > GIVE_UP_LATE) == (lost > 0)
    assert lateness[-1] == pytest.approx(0.0), 'caught up'
    assert driver.calls == 21 * ['read', 'write', 'advance']
