# SPDX-License-Identifier: Apache-2.0
"""The robot node as a process, met only through its topics and services; with a servo, too."""

from collections.abc import Callable
from itertools import pairwise
import math
from pathlib import Path
import signal
import time

import numpy as np
import pytest
from rcl_interfaces.srv import ListParameters
from rclpy.serialization import deserialize_message, serialize_message
from std_srvs.srv import SetBool
from tests.commands import LEO
from tests.graph.robot_process import CONTROL_PERIOD_NS, PATIENCE, PENDULUM, Robot
from tests.places import ROOT

from leo_diffmodel.bags.writer import BagWriter
from leo_msgs_py import topics
from leo_msgs_py.cli import main
from leo_msgs_py.node import call, spin_once
from leo_msgs_py.values import time_message
from leo_sim.drivers.base import DriverOptions
from leo_sim.drivers.simulated import SimulatedDriver

pytestmark = pytest.mark.graph
SCRIPT = str(ROOT / 'src/leo_sim/scripts/robot')
SECRET = '7319'
STATE_PERIOD_NS = round(1e9 / PENDULUM.state_rate)


def swing(robot: Robot, periods: int) -> tuple[list[bytes], list[bytes]]:
    """Run in lockstep; the bytes of states (repeats dropped) and of what was applied."""
    robot.ready()
    for k in range(periods):
        robot.step(2.0 * math.sin(k))
    end = robot.states[-1].stamp_ns
    robot.wait(lambda: robot.applied[-1].stamp_ns + STATE_PERIOD_NS >= end, 'not all applied')
    states = robot.state_bytes
    return [b for i, b in enumerate(states) if not i or b != states[i - 1]], robot.applied_bytes


def test_lockstep_repeats_to_the_bit_for_a_seed(robots):
    options = {
        'realtime_factor': 0,
        'seed': 3,
        'start': 'random',
        'noise': '[0.001, 0.05]',
        'hidden_seed': 5,
    }
    first, again, other = (
        swing(robots(space, **{**options, **change}), periods=20)
        for space, change in (('/one', {}), ('/two', {}), ('/three', {'seed': 4}))
    )
    ticks = 20 * CONTROL_PERIOD_NS // STATE_PERIOD_NS
    assert (len(first[0]), len(first[1])) == (ticks + 1, ticks)
    assert first == again
    assert first[0] != other[0]


def test_safety_and_services_in_lockstep(robots):
    robot = robots('/safe', realtime_factor=0).ready()
    assert robot.states[0].stamp_ns == 0
    assert robot.step(1.0).values.tolist() == [1.0]
    assert robot.step(100.0).values.tolist() == [3.0], 'clipped to the limit'

    robot.send(1.0, 2.0)
    robot.wait(lambda: 'it has 2 values, the robot has 1 actuators' in robot.said())
    robot.send(math.nan)
    robot.wait(lambda: len(robot.states) > len(robot.fresh()) + 2, 'no repeats')
    assert robot.step(1.0).values.tolist() == [1.0], 'goes on with the next good command'

    assert robot.call(topics.E_STOP).success
    robot.wait(lambda: robot.e_stopped[-1])
    for _ in range(3):
        applied = robot.step(2.0)
        assert applied.values.tolist() == [0.0] and applied.enabled.tolist() == [True]
    episode = robot.episodes[-1]
    assert robot.call(topics.E_STOP_RESET).success
    robot.wait(lambda: not robot.e_stopped[-1] and robot.episodes[-1] == episode + 1)
    assert robot.step(2.0).values.tolist() == [2.0]

    assert robot.call(topics.TORQUE, SetBool.Request(data=False)).success
    assert robot.step(2.0).enabled.tolist() == [False]
    assert robot.call(topics.TORQUE, SetBool.Request(data=True)).success
    assert robot.step(2.0).enabled.tolist() == [True]

    before = robot.states[-1]
    assert robot.call(topics.RESET).success
    robot.wait(lambda: robot.episodes[-1] == episode + 2)
    robot.wait(lambda: robot.states[-1].stamp_ns > before.stamp_ns)
    assert robot.states[-1].position.tolist() == robot.states[0].position.tolist()
    assert robot.stop(signal.SIGTERM) == 0


def keeps_time(robot: Robot) -> bool:
    """Whether the last second of the robot's time took a second; a busy machine delays some."""
    stamps = [state.stamp for state in robot.states]
    start = next(k for k, stamp in enumerate(stamps) if stamp >= stamps[-1] - 1.0)
    took = robot.heard[-1] - robot.heard[start]
    passed = stamps[-1] - stamps[start]
    return passed > 0.95 and took == pytest.approx(passed, abs=0.05)


def test_realtime_times_out_and_survives_kill_9(node, robots, capsys):
    robot = robots('/real', command_timeout=3.0, hidden_seed=5).ready()
    robot.send(1.5)
    robot.wait(lambda: robot.obeyed(1.5), 'no command')
    robot.wait(lambda: robot.applied[-1].values.tolist() == [0.0])
    held = [a.stamp_ns for a in robot.applied if a.values.tolist() == [1.5]]
    assert 2.9e9 <= held[-1] - held[0] <= 3.1e9
    robot.wait(lambda: keeps_time(robot), 'no second of its time was one on the wall')

    client = node.create_client(ListParameters, '/real/robot/list_parameters')
    names = call(client, ListParameters.Request(), PATIENCE).result.names
    assert 'realtime_factor' in names and not any('hidden' in name for name in names)

    episode = robot.episodes[-1]
    robot.stop(signal.SIGKILL)
    robot.states.clear()
    robot.heard.clear()
    robot.process = robot.start()
    robot.wait(lambda: robot.episodes[-1] == episode + 1 and robot.states, 'no restart')
    robot.wait(lambda: robot.send(0.5) or robot.obeyed(0.5), 'no command after restart')
    assert robot.stop() == 0
    assert main(['reveal', str(robot.folder / 'hidden.sealed')]) == 0
    assert capsys.readouterr().out.startswith('robot pendulum: 1 hidden effect')


def recorded(folder: Path, count: int) -> list[tuple]:
    bag, sent = BagWriter(folder), []
    driver = SimulatedDriver(DriverOptions(PENDULUM, noise=(0.001, 0.05)))
    channels = [
        bag.add_topic('/joint_states', 'sensor_msgs/msg/JointState'),
        bag.add_topic('/robot/applied_voltage', 'sensor_msgs/msg/JointState'),
    ]
    for k in range(count):
        rows = driver.read().to_message(), driver.write(np.array([math.sin(k)])).to_message()
        sent.append(rows)
        for channel, row in zip(channels, rows, strict=True):
            bag.write(channel, serialize_message(row), k)
        driver.advance(0.01)
    bag.close()
    return sent


def drive_to_the_end(robot: Robot, heard: Callable[[], bool]) -> None:
    end = time.monotonic() + PATIENCE
    while robot.process.poll() is None or not heard():
        assert time.monotonic() < end, robot.said()
        robot.send(3.0)
        spin_once(0.05)
    assert robot.ended() == 0


def test_a_bag_that_ends_in_lockstep_ends_the_node(robots, tmp_path):
    recorded(tmp_path / 'bag', 40)
    robot = robots('/ended', driver='replay', bag=tmp_path / 'bag', realtime_factor=0)
    drive_to_the_end(robot, lambda: True)
    assert 'has ended after 40 states' in robot.said()


def test_a_replayed_bag_feeds_the_graph_as_the_robot_did(robots, tmp_path):
    sent = recorded(tmp_path / 'bag', 400)
    robot = robots('/replay', driver='replay', bag=tmp_path / 'bag')
    last = sent[-1][0].header.stamp
    said = robot.states, robot.applied
    drive_to_the_end(robot, lambda: all(m and time_message(m[-1].stamp_ns) == last for m in said))
    assert 'has ended after 400 states' in robot.said()
    count = min(len(robot.states), len(robot.applied))
    assert count >= 100
    heard = [
        [deserialize_message(data, topics.JOINT_STATES.type) for data in received[-count:]]
        for received in (robot.state_bytes, robot.applied_bytes)
    ]
    assert list(zip(*heard, strict=True)) == sent[-count:]


@pytest.mark.parametrize('program', [(LEO, 'run', 'leo_sim', 'robot'), (SCRIPT,)])
def test_a_secret_that_was_typed_leaves_the_process_list_before_the_imports(
    spawn, program, tmp_path, monkeypatch
):
    monkeypatch.chdir(tmp_path)
    robot = spawn(*program, '--ros-args', '-p', f'hidden_seed:={SECRET}')
    files = Path(f'/proc/{robot.pid}')
    while 'rclpy' not in (files / 'maps').read_text():
        assert robot.poll() is None
    listed = (files / 'cmdline').read_text()
    assert 'hidden_seed:=?' in listed and SECRET not in listed


def test_goals_are_bounded_and_nothing_goes_back_to_one_of_before(robots):
    robot = robots('/servo', interface='position', robot='xl330_pendulum', realtime_factor=0)
    robot.ready()
    assert robot.step(0.5).values.tolist() == [0.5]
    assert robot.step(100.0).values.tolist() == [math.pi], 'clipped to the limit'
    for _ in range(30):
        robot.step(0.5)
    assert robot.states[-1].position[0] > 0.2

    stopped = robot.call(topics.E_STOP)
    assert stopped.success and 'motors free' in stopped.message
    robot.wait(lambda: robot.e_stopped[-1])
    assert robot.step(0.5).enabled.tolist() == [False]
    assert robot.call(topics.E_STOP_RESET).success
    robot.wait(lambda: not robot.e_stopped[-1])
    assert robot.step(0.5).nan_where_free.tolist() == [0.5]

    assert robot.call(topics.TORQUE, SetBool.Request(data=False)).success
    assert robot.step(0.5).enabled.tolist() == [False]
    assert robot.call(topics.TORQUE, SetBool.Request(data=True)).success
    assert robot.step(0.5).enabled.tolist() == [True]
    assert robot.stop(signal.SIGTERM) == 0


def test_in_real_time_a_goal_slews_from_where_the_joint_is_and_is_held(robots):
    robot = robots('/held', interface='position', robot='xl330_pendulum', slew=1.0)
    robot.ready()
    robot.wait(lambda: robot.applied and not robot.applied[-1].enabled.any(), 'not free')
    robot.wait(lambda: robot.send(0.4) or robot.obeyed(0.4), 'no goal')
    goals = [float(a.values[0]) for a in robot.applied if a.enabled.all()]
    steps = [b - a for a, b in pairwise(goals)]
    assert abs(goals[0]) < 0.1 and max(steps) < 0.1, 'it went there in one step'
    count = len(robot.applied)
    robot.wait(lambda: len(robot.applied) > count + 60)
    assert robot.applied[-1].nan_where_free.tolist() == [0.4], 'held after the time-out'
    assert robot.stop() == 0
