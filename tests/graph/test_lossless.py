# SPDX-License-Identifier: Apache-2.0
"""Nothing is lost in lockstep: not beside a recorder, not while one stands still."""

from pathlib import Path
import signal
import subprocess
from threading import Timer

import numpy as np
import pytest
from tests import live_bag

from leo_diffmodel.bags.contents import load
from leo_diffmodel.bags.recorder import header_stamp
from leo_learner.robot_env import RobotEnv
from leo_msgs_py import topics
from leo_sim.robot import load_robot

pytestmark = pytest.mark.graph
PATIENCE = 120.0
PENDULUM = load_robot('pendulum')
RUN = 'import sys; from leo_msgs_py.cli import main; sys.exit(main(sys.argv[1:]))'
APPLIED = topics.APPLIED['voltage']
FAST = 1000
"""States per second: 50 of them for each command."""
HISTORY = 5000
"""Messages that Fast DDS keeps for a reader and for a writer that keep all."""


@pytest.fixture
def recorded(node, spawn, tmp_path):
    """A robot in lockstep as an environment, and the process that records it into a bag."""
    words = 'robot:=pendulum', 'realtime_factor:=0', f'state_rate:={FAST}', 'engine:=rigid'
    given = [word for parameter in words for word in ('-p', parameter)]
    spawn('-c', RUN, 'run', 'leo_sim', 'robot', '--ros-args', *given)
    bag = tmp_path / 'bag'
    recorder = spawn('-c', RUN, 'bag', 'record', '-o', str(bag), stdout=subprocess.PIPE)
    env = RobotEnv(node, PENDULUM)
    env.reset()
    while not live_bag.has(bag, topics.JOINT_STATES, APPLIED):
        env.step(np.zeros(1))
    return env, recorder, bag


def stamps(bag: Path, topic: topics.Topic) -> np.ndarray:
    """Stamps [ns] of the messages of a topic, repeated ones once."""
    return np.unique([header_stamp(m.data) for m in load(bag).topics[f'/{topic.name}'].messages])


def finish(env: RobotEnv, recorder: subprocess.Popen, bag: Path, begin: int) -> None:
    """Wait for the last state, end the recorder, and see that none since `begin` is missing."""
    end, period = env._state.stamp_ns, round(1e9 / FAST)
    while live_bag.newest(bag, topics.JOINT_STATES) < end:
        assert recorder.poll() is None
        env.step(np.zeros(1))
    recorder.send_signal(signal.SIGINT)
    assert recorder.wait(PATIENCE) == 0
    for topic in (topics.JOINT_STATES, APPLIED):
        found = stamps(bag, topic)
        assert np.isin(np.arange(begin, end, period), found).all(), topic.name


def test_a_lockstep_run_is_recorded_whole(recorded):
    env, recorder, bag = recorded
    begin = env._state.stamp_ns
    for volts in np.random.default_rng(0).uniform(-3, 3, (100, 1)):
        env.step(volts)
    finish(env, recorder, bag, begin)


def test_a_recorder_that_stands_still_holds_the_robot_up_and_loses_nothing(recorded):
    env, recorder, bag = recorded
    recorder.send_signal(signal.SIGSTOP)
    going_on = Timer(1.0, recorder.send_signal, [signal.SIGCONT])
    going_on.start()
    begin = env._state.stamp_ns
    for volts in np.random.default_rng(0).uniform(-3, 3, (2 * HISTORY * 20 // FAST, 1)):
        env.step(volts)
    going_on.join()
    assert env._state.stamp_ns - begin > 1.9 * HISTORY * round(1e9 / FAST)
    finish(env, recorder, bag, begin)
