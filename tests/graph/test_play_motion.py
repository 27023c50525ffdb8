# SPDX-License-Identifier: Apache-2.0
"""A motion is played on a robot node, which takes up its start pose, and recorded meanwhile."""

import numpy as np
import pytest
from rclpy.node import Node
from tests.patience import PATIENCE

from leo_diffmodel.bags.recording import read_bag
from leo_msgs_py import topics
from leo_msgs_py.cli import main
from leo_msgs_py.node import graph, join, spin_until
from leo_sim.description.robot import load_robot

pytestmark = pytest.mark.graph
LEO = load_robot('leo')
RUN = 'import sys; from leo_msgs_py.cli import main; sys.exit(main(sys.argv[1:]))'


@pytest.fixture
def robot(domain, spawn):
    """LEO in lockstep, up and running."""
    parameters = ('robot:=leo', 'realtime_factor:=0', 'engine:=rigid')
    given = [word for parameter in parameters for word in ('-p', parameter)]
    spawn('-c', RUN, 'run', 'leo_sim', 'robot', '--ros-args', *given)
    heard: list[object] = []
    with graph():
        node = join(Node('watch'))
        node.create_subscription(*topics.JOINT_STATES[:2], heard.append, topics.JOINT_STATES.qos)
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
