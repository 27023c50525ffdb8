# SPDX-License-Identifier: Apache-2.0
"""What the robot node does when its hardware fails, hangs, or is commanded by two."""

from itertools import pairwise
import math
import re
import time

import pytest
from rclpy.node import Node
from tests.graph.robot_process import PATIENCE, Robot
from tests.places import RIG

from leo_msgs_py import topics
from leo_msgs_py.node import spin_once, spin_until
from leo_msgs_py.values import command_message

pytestmark = pytest.mark.graph
ASK = """
import rclpy
from rcl_interfaces.msg import Parameter, ParameterValue
from rcl_interfaces.srv import SetParameters

rclpy.init()
node = rclpy.create_node('stranger')
client = node.create_client(SetParameters, '/asked/robot/set_parameters')
names = [Parameter(name=str(i), value=ParameterValue(type=4)) for i in range(100_000)]
client.wait_for_service()
rclpy.spin_until_future_complete(
    node, client.call_async(SetParameters.Request(parameters=names)))
"""


class Rig(Robot):
    def __init__(self, start, space: str, driver=RIG, **parameters) -> None:
        self.__dict__ = start(space, driver=driver, **parameters).__dict__

    def order(self, text: str) -> None:
        made = self.folder / 'orders.new'
        made.write_text(text)
        made.rename(self.folder / 'orders')

    def release(self) -> None:
        (self.folder / 'released').touch()

    def holds_while_driven(self, command: float) -> None:
        """Let a read hang; again where a busy machine had brought the motors to 0 before it."""
        driven = f'write {command}'
        self.waits_for(driven, command)
        self.order('hold')
        self.waits_for('begin hold', command)
        calls = self.calls()
        if calls[calls.index('begin hold') - 1] != driven:
            self.release()
            self.waits_for('end hold', command)
            (self.folder / 'calls').write_text('')
            self.holds_while_driven(command)

    def halts_while_held(self, command: float) -> None:
        """Wait for a halt while a read is held; then let it go on."""
        start = self.calls().index('begin hold')
        self.wait(lambda: self.send(command) or 'halt 0.0' in self.calls()[start:], 'no halt')
        self.release()
        self.waits_for('end hold', command)

    def fatal(self) -> str:
        assert self.ended() == 1 and self.calls()[-1] == 'stop'
        (line,) = (line for line in self.said().splitlines() if '[FATAL]' in line)
        return line

    def calls(self) -> list[str]:
        """What the driver was asked for, without times: 'write 1.0'."""
        lines = (self.folder / 'calls').read_text().splitlines()
        return [line.split(' ', 1)[1].strip() for line in lines]

    def waits_for(self, call: str, command: float | None = None) -> None:
        def made() -> bool:
            if command is not None:
                self.send(command)
            return call in self.calls()

        self.wait(made, f'no {call}')

    def written(self) -> list[tuple[float, float]]:
        """When what was written, as of time.monotonic [s]."""
        lines = map(str.split, (self.folder / 'calls').read_text().splitlines())
        return [(float(line[0]), float(line[2])) for line in lines if line[1] == 'write']

    def diagnosis(self) -> dict[str, str]:
        heard = []
        listener = self.node.create_subscription(*topics.DIAGNOSTICS[:2], heard.append, 10)
        self.wait(lambda: any(m.status[0].name.startswith(self.space) for m in heard))
        self.node.destroy_subscription(listener)
        status = next(m.status[0] for m in heard if m.status[0].name.startswith(self.space))
        return {'message': status.message, **{pair.key: pair.value for pair in status.values}}


@pytest.fixture
def no_halt(tmp_path):
    driver = tmp_path / 'no_halt.py'
    driver.write_text(RIG.read_text().replace('def halt', 'def brake'))
    return driver


@pytest.fixture
def rig(robots):
    return lambda space, **parameters: Rig(robots, space, **parameters).ready()


def test_a_lost_packet_is_counted_and_answered_by_zero_and_no_state(rig):
    robot = rig('/lost')
    robot.waits_for('write 1.0', command=1.0)
    robot.order('lose 3')
    robot.waits_for('end lose', command=1.0)
    robot.wait(lambda: robot.calls()[robot.calls().index('end lose') :].count('write 0.0') >= 3)
    calls = robot.calls()
    after = calls[calls.index('end lose') + 1 :]
    assert after[:3] == 3 * ['write 0.0'], 'whatever is commanded'
    robot.wait(lambda: robot.send(1.0) or 'write 1.0' in robot.calls()[len(calls) :])
    assert robot.diagnosis()['driver faults'] == '3'
    assert robot.diagnosis()['last driver fault'] == 'no answer from servo 1'
    assert robot.stop() == 0


def test_no_state_is_published_that_was_not_measured(rig):
    robot = rig('/blind', state_rate=20, fault_periods=100)
    robot.order('lose 40')
    robot.waits_for('end lose')
    lost_ns = time.time_ns()
    robot.wait(lambda: robot.states[-1].stamp_ns > lost_ns)
    gaps = [b.stamp - a.stamp for a, b in pairwise(robot.states)]
    assert max(gaps) > 20 * 0.05, 'a state without a measurement'


def test_a_driver_that_keeps_failing_ends_the_node_with_one_line(rig):
    robot = rig('/broken', fault_periods=4)
    episode = robot.episodes[-1]
    robot.order('lose 1000')
    said = '5 periods in a row failed, the last one: no answer from servo 1'
    assert said in robot.fatal()
    robot.process = robot.start()
    robot.wait(lambda: robot.episodes[-1] == episode + 1, 'the episode is not picked up')


@pytest.mark.parametrize(
    ('order', 'said'),
    [
        ('bug read', r'rig\.py line \d+: ValueError: read; mend the driver; the robot ends here'),
        ('bug write', r'rig\.py line \d+: ValueError: write; mend the driver; the robot ends'),
        ('break', 'Input/output error'),
        ('rubbish', r'rig\.py: read returned list, not JointStates; mend the driver'),
    ],
)
def test_a_cable_that_is_out_or_code_that_fails_ends_the_node_with_one_line(rig, order, said):
    robot = rig('/wrong')
    robot.waits_for('write 1.0', command=1.0)
    robot.order(order)
    assert re.search(said, robot.fatal())


def test_a_driver_that_cannot_stop_is_written_zero(rig):
    robot = rig('/endless')
    robot.waits_for('write 1.0', command=1.0)
    robot.order('bug stop')
    robot.waits_for('end bug', command=1.0)
    assert robot.stop() == 1
    assert 'could not be stopped' in robot.said()
    assert robot.calls()[-1] == 'write 0.0'


def test_a_watchdog_that_cannot_halt_says_so(rig):
    robot = rig('/unhalted', command_timeout=60.0)
    robot.order('bug halt')
    robot.waits_for('end bug', command=1.0)
    robot.waits_for('write 1.0', command=1.0)
    robot.order('hold')
    robot.wait(lambda: robot.send(1.0) or 'the watchdog cannot halt the motors' in robot.said())
    robot.release()
    assert robot.stop() == 0


@pytest.mark.parametrize('timeout', [0.2, 0.0])
def test_a_read_that_hangs_delays_no_zero(rig, timeout):
    """Without a time-out too: who is not measured is not driven."""
    robot = rig('/hung', command_timeout=timeout)
    robot.holds_while_driven(command=1.0)
    robot.halts_while_held(command=1.0)
    assert int(robot.diagnosis()['stopped by the watchdog']) >= 1


def test_an_e_stop_acts_while_a_read_hangs(rig):
    robot = rig('/stopped', command_timeout=60.0, fault_periods=10**6)
    robot.holds_while_driven(command=1.0)
    assert robot.call(topics.E_STOP).success
    robot.halts_while_held(command=1.0)
    calls = robot.calls()
    robot.wait(lambda: robot.send(1.0) or len(robot.calls()) > len(calls) + 10)
    assert set(robot.calls()[calls.index('end hold') + 1 :]) == {'write 0.0'}


def test_a_request_that_takes_long_to_decode_delays_no_zero(rig, no_halt, spawn):
    """Nothing is written for longest while it is decoded, and 0 was written last before."""
    robot = rig('/asked', driver=no_halt)
    robot.waits_for('write 1.0', command=1.0)
    spawn('-c', ASK)
    robot.wait(lambda: robot.send(1.0) or 'request refused' in robot.said())
    count = len(robot.written())
    robot.wait(lambda: len(robot.written()) > count)
    gaps = [(after - at, volts) for (at, volts), (after, _) in pairwise(robot.written())]
    longest, volts = max(gaps)
    assert volts == 0.0
    assert max(gap for gap, volts in gaps if volts) < 0.5 * longest, 'half of it is for the load'
    robot.wait(lambda: int(robot.diagnosis()['stopped by the watchdog']) >= 1)
    assert robot.stop() == 0


def test_a_command_that_waited_too_long_does_not_move_the_robot(rig):
    robot = rig('/late')
    robot.order('hold')
    robot.waits_for('begin hold')
    robot.send(2.0)
    time.sleep(1.0)  # five times as long as a command holds
    robot.release()
    robot.wait(lambda: 'it was sent' in robot.said(), 'a stale command was taken')
    assert 'write 2.0' not in robot.calls()
    assert robot.diagnosis()['stale commands'] == '1'


def test_garbage_displaces_no_command_and_of_those_that_wait_the_newest_counts(rig):
    robot = rig('/garbage', command_timeout=60.0)
    robot.order('hold')
    robot.waits_for('begin hold')
    for volts in (1.0, 2.0, *15 * [math.nan]):
        robot.send(volts)
        time.sleep(0.01)
    robot.release()
    robot.waits_for('write 2.0')
    assert 'write 1.0' not in robot.calls()
    assert robot.diagnosis()['rejected commands'] == '15'


def test_two_that_command_in_turns_stop_the_robot_and_one_after_another_do_not(rig):
    robot = rig('/two')
    topic = topics.COMMANDS['voltage'].type, robot.commands.topic_name, 1
    for volts in (0.5, 1.0, 1.5):
        made = robot.node.create_publisher(*topic)
        assert spin_until(lambda p=made: p.get_subscription_count() > 0, PATIENCE)
        robot.wait(lambda p=made, v=volts: p.publish(command_message([v])) or robot.obeyed(v))
        robot.node.destroy_publisher(made)
        end = time.monotonic() + 1.1
        robot.wait(lambda e=end: time.monotonic() > e)
    assert not robot.e_stopped[-1]
    rival = robot.node.create_publisher(*topic)
    robot.wait(lambda: '2 publishers' in robot.said(), 'no warning of a second one')
    assert robot.diagnosis()['commanders'] == '2'
    robot.wait(lambda: robot.send(1.0) or robot.obeyed(1.0))
    assert not robot.e_stopped[-1], 'a silent second one harms nothing'
    robot.wait(lambda: _in_turns(robot, rival) or robot.e_stopped[-1], 'they are not stopped')
    assert 'two send commands in turns' in robot.said()
    assert robot.stop() == 0


def _in_turns(robot: Rig, rival) -> None:
    for publisher, volts in ((robot.commands, 1.0), (rival, -1.0)):
        publisher.publish(command_message([volts]))
        spin_once(0.02)


def test_two_robots_that_obey_the_same_commands_say_so(rig, node):
    robot = rig('/twin')
    other = Node('other', namespace='/twin')
    other.create_publisher(*topics.JOINT_STATES)
    recorder = Node('recorder', namespace='/twin')
    for listener in (other, recorder):
        listener.create_subscription(*topics.COMMANDS['voltage'][:2], lambda _: None, 1)
    robot.wait(lambda: 'another robot, /twin/other,' in robot.said())
    diagnosis = robot.diagnosis()
    assert diagnosis['other robots'] == '/twin/other' in diagnosis['message']
    other.destroy_node()
    robot.wait(lambda: robot.diagnosis()['other robots'] == 'none')
    recorder.destroy_node()
    (line,) = (line for line in robot.said().splitlines() if 'another robot' in line)
    assert 'give each a ROS_DOMAIN_ID or a namespace' in line
