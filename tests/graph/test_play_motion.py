# SPDX-License-Identifier: Apache-2.0
"""A motion is played on a robot node, which takes up its start pose, and recorded meanwhile."""

import subprocess
import sys

import numpy as np
import pytest

from leo_diffmodel.bags.recording import read_bag
from leo_msgs_py import topics
from leo_msgs_py.node import spin_until
from leo_sim.robot import load_robot

pytestmark = pytest.mark.graph
PATIENCE = 120.0
LEO = load_robot('leo')
RUN = 'import sys; from leo_msgs_py.cli import main; sys.exit(main(sys.argv[1:]))'


def play(*args: str) -> str:
    command = [sys.executable, '-c', RUN, 'play', *args]
    done = subprocess.run(command, capture_output=True, text=True, timeout=PATIENCE)
    assert done.returncode == 0, done.stderr
    return done.stdout


def test_hanging_then_standing_each_in_a_bag_of_its_own(node, spawn, tmp_path):
    parameters = ('robot:=leo', 'realtime_factor:=0', 'engine:=rigid')
    given = [word for parameter in parameters for word in ('-p', parameter)]
    spawn('-c', RUN, 'run', 'leo_sim', 'robot', '--ros-args', *given)
    heard: list[object] = []
    node.create_subscription(*topics.JOINT_STATES[:2], heard.append, topics.JOINT_STATES.qos)
    assert spin_until(lambda: bool(heard), PATIENCE)
    for motion, pose in (('swinging', 'hanging'), ('standing', 'standing')):
        bag = tmp_path / motion
        said = play(motion, '--seconds', '0.9', '--seed', '2', '--bag', str(bag))
        assert f'{motion} on the robot: 0.9 s' in said and f'wrote {bag}' in said
        recording = read_bag(bag, LEO)
        assert recording.metadata['start'] == pose
        assert recording.held == LEO.start_poses[pose].held
        last = recording.episodes[-1]
        commanded = last.inputs[:90].reshape(30, 3, 6)
        np.testing.assert_array_equal(commanded, commanded[:, :1].repeat(3, axis=1))
        assert np.ptp(commanded, axis=0).min() > 0.1
        assert bool(np.ptp(last.q[:, 2])) != recording.held
