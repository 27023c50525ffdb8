# SPDX-License-Identifier: Apache-2.0
"""A run file goes to a robot node and comes back as what was applied; a motion is recorded."""

import os
import time

import numpy as np
import pytest
from rclpy.node import Node
from tests.commands import start, start_node
from tests.patience import PATIENCE

from leo_diffmodel.bags.recording import read_bag
from leo_diffmodel.next_run.menu import menu
from leo_diffmodel.next_run.reach import Reach
from leo_diffmodel.next_run.run_file import read_run, Run, write_run
from leo_msgs_py import topics
from leo_msgs_py.cli import main
from leo_msgs_py.node import graph, join, listen, spin_once, spin_until
from leo_msgs_py.values import Applied
from leo_sim.description.robot import load_robot

pytestmark = pytest.mark.graph
PENDULUM, LEO = load_robot('pendulum'), load_robot('leo')
LOCKSTEP = 'realtime_factor:=0'


def periods(heard: list[Applied]) -> np.ndarray:
    number = [a.stamp_ns // round(1e9 * PENDULUM.control_period) for a in heard]
    return np.unique(number, return_index=True)[1]


def applied_by(node: Node, interface: str) -> list[Applied]:
    heard: list[Applied] = []
    topic = topics.APPLIED[interface]._replace(qos=topics.LOSSLESS)
    listen(node, topic, lambda m: heard.append(Applied.from_message(m, interface)))
    return heard


def test_what_the_file_says_is_what_the_robot_applies(node, spawn, tmp_path):
    runs = menu(PENDULUM, Reach.of_levels(2 * np.ones(1)), 5.0)
    (run,) = (r for r in runs if r.name == 'kick and let go')
    path = write_run(tmp_path / 'run.csv', run, PENDULUM)
    heard = applied_by(node, 'voltage')
    found: list[int] = []  # the robot has found what was subscribed to before
    listen(node, topics.EPISODE, lambda m: found.append(m.data))
    start_node(spawn, 'leo_sim', 'robot', 'robot:=pendulum', LOCKSTEP)
    assert spin_until(lambda: bool(found), PATIENCE)
    player = start(spawn, 'play', str(path), '--yes')
    end = time.monotonic() + PATIENCE
    while player.poll() is None or not periods(heard).size >= run.count:
        assert time.monotonic() < end, len(heard)
        spin_once(0.05)
    assert player.returncode == 0
    applied = [heard[k] for k in periods(heard)[-run.count :]]
    values = np.array([a.values for a in applied])
    enabled = np.array([a.enabled[0] for a in applied])
    np.testing.assert_allclose(values, run.inputs, atol=1e-5)
    np.testing.assert_array_equal(enabled, run.enabled)
    assert not enabled.all()


def test_a_run_file_reads_as_it_was_written(tmp_path):
    for run in menu(PENDULUM, Reach.of_levels(2 * np.ones(1)), 5.0):
        again = read_run(write_run(tmp_path / 'run.csv', run, PENDULUM)).run_for(PENDULUM)
        np.testing.assert_allclose(again.inputs, run.inputs, atol=1e-5)
        np.testing.assert_array_equal(again.enabled, run.enabled)
        assert again.name == run.name


def test_servos_go_gently_to_where_a_run_begins_once_somebody_agreed(node, spawn, tmp_path):
    servo = load_robot('xl330_pendulum')
    run = Run('far', '', np.linspace(0.6, 0.7, 20)[:, None], np.ones(20, bool))
    path = write_run(tmp_path / 'run.csv', run, servo)
    heard = applied_by(node, 'position')
    start_node(spawn, 'leo_sim', 'robot', 'robot:=xl330_pendulum', LOCKSTEP)
    ours, theirs = os.openpty()
    for typed, status in ((b'n\n', 1), (b'y\n', 0)):
        assert not heard, 'sent, though nobody agreed'
        os.write(ours, typed)
        player = start(spawn, 'play', str(path), stdin=theirs)
        assert spin_until(lambda p=player: p.poll() is not None, PATIENCE)
        assert player.returncode == status
    assert spin_until(lambda: heard[-1].values[0] == pytest.approx(0.7), PATIENCE)
    goals = np.array([a.values[0] for a in heard])
    assert abs(goals[0]) < 0.01, 'from where the servo was'
    steps = np.abs(np.diff(goals)) / servo.control_period
    assert steps[: -len(run.inputs)].max() < 0.51 and 0.6 in goals.round(5)


@pytest.fixture
def robot(domain, spawn):
    start_node(spawn, 'leo_sim', 'robot', 'robot:=leo', LOCKSTEP, 'engine:=rigid')
    heard: list[object] = []
    with graph():
        node = join(Node('watch'))
        listen(node, topics.JOINT_STATES, heard.append)
        assert spin_until(lambda: bool(heard), PATIENCE)


@pytest.mark.usefixtures('robot')
def test_hanging_then_standing_each_in_a_bag_of_its_own(tmp_path, capfd):
    for motion, pose in (('swinging', 'hanging'), ('standing', 'standing')):
        bag = tmp_path / motion
        words = motion, '--seconds', '0.9', '--seed', '2', '--bag', str(bag)
        assert main(['play', *words]) == 0
        said = capfd.readouterr().out
        assert f'{motion} on the robot: 0.9 s' in said and f'wrote {bag}' in said
        recording = read_bag(bag, LEO)
        assert recording.metadata['start'] == pose
        assert recording.held == LEO.start_poses[pose].held
        last = recording.episodes[-1]
        commanded = last.inputs[:90].reshape(30, 3, 6)
        np.testing.assert_array_equal(commanded, commanded[:, :1].repeat(3, axis=1))
        assert np.ptp(commanded, axis=0).min() > 0.1
        assert bool(np.ptp(last.q[:, 2])) != recording.held
