# SPDX-License-Identifier: Apache-2.0
"""The environment on a running robot, which is heard by hand: whose states count, lost ones."""

from types import SimpleNamespace
from unittest.mock import MagicMock

import numpy as np
import pytest

from leo_learner.robot.env import RobotEnv
from leo_learner.robot.running import RobotPlayer
from leo_msgs_py.errors import UserError
from leo_msgs_py.values import Applied, JointStates
from leo_sim.model import Model, State


@pytest.fixture
def robot_env(monkeypatch):
    env = RobotEnv(MagicMock(), Model('pendulum').robot)
    monkeypatch.setattr(env, '_name_of_robot', lambda: '')
    for name in ('REMIND', 'FIRST_REMINDER', 'SET_BACK'):
        monkeypatch.setattr(f'leo_learner.robot.env.{name}', 0.0)
    monkeypatch.setattr('leo_learner.robot.env.running', lambda: True)
    return env


def heard(env, monkeypatch, *states):
    """Hand over (stamp [s], joints) one after the other, as the environment waits."""
    waiting = iter(enumerate(states))

    def spin_once():
        number, (stamp, names) = next(waiting)
        zeros = np.zeros(len(names))
        message = JointStates(round(stamp * 1e9), names, zeros, zeros).to_message()
        env._states._on_message(message, {'publication_sequence_number': number})

    monkeypatch.setattr('leo_learner.robot.env.spin_once', spin_once)


def test_the_joints_of_the_robot_must_come_at_last(robot_env, monkeypatch):
    heard(robot_env, monkeypatch, *[(k, ('gripper',)) for k in range(3)])
    with pytest.raises(UserError, match=r'joint states of gripper: pivot is missing'):
        robot_env.reset()


@pytest.mark.parametrize('back', [3600.0, 0.01])
def test_stamps_that_fall_back_end_the_episode(robot_env, monkeypatch, back):
    pivot = ('pivot',)
    robot_env._on_episode(SimpleNamespace(data=1))
    heard(robot_env, monkeypatch, (9000.0, pivot), (9000.0, ('gripper',)), (9000.0 - back, pivot))
    robot_env.begin_here()
    assert robot_env.step(np.zeros(1))[3:] == (True, {'lost': True})
    assert 'fell back by' in robot_env._node.get_logger().warning.call_args[0][0]


@pytest.mark.parametrize('name', ['', 'pendulum'])
def test_a_robot_that_says_it_is_another_one_is_refused(robot_env, monkeypatch, name):
    robot_env._on_episode(SimpleNamespace(data=1))
    heard(robot_env, monkeypatch, (1.0, ('pivot',)))
    monkeypatch.setattr(robot_env, '_name_of_robot', lambda: name)
    assert robot_env.next_state().q == [0.0]
    monkeypatch.setattr(robot_env, '_name_of_robot', lambda: 'servo_pendulum')
    with pytest.raises(UserError, match="the running robot is 'servo_pendulum', this is for 'pen"):
        robot_env.reset()


def test_a_robot_that_refuses_a_reset_is_heard(monkeypatch):
    node = MagicMock()
    env = RobotEnv(node, Model('pendulum').robot)
    refusal = SimpleNamespace(success=False, message='pivot is 0.80 off')
    monkeypatch.setattr(env, '_call', lambda *_: refusal)
    monkeypatch.setattr(env, '_wait', lambda *_, **__: True)
    assert env._after_reset() is None
    assert 'pivot is 0.80 off' in node.get_logger().info.call_args[0][0]


def test_servos_go_on_from_the_goal_that_holds_them_and_free_ones_from_where_they_are(monkeypatch):
    robot = Model('xl330_pendulum').robot
    sagged = State(np.array([0.3]), np.zeros(1))
    monkeypatch.setattr('leo_learner.robot.running.spin_until', lambda *_: True)
    player = RobotPlayer(MagicMock(), SimpleNamespace(robot=robot, next_state=lambda: sagged))
    assert player.goals() == [0.3]
    for enabled, goal in ((True, 0.4), (False, 0.3)):
        applied = Applied(1, ('pivot',), np.array([0.4]), 'position', np.array([enabled]))
        player._on_applied(applied.to_message())
        assert player.goals() == [goal]
