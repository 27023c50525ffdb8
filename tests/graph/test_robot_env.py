# SPDX-License-Identifier: Apache-2.0
"""The robot node as an environment: the same steps as the model, in lockstep and in real time."""

import signal
import subprocess
import time

import numpy as np
import pytest
from tests import commands
from tests.commands import start_node
from tests.patience import PATIENCE

from leo_learner.environment.env import ModelEnv
from leo_learner.robot.env import RobotEnv
from leo_msgs_py.errors import UserError
from leo_sim.model import Model

pytestmark = pytest.mark.graph
LOCKSTEP = 'realtime_factor:=0'


@pytest.fixture
def robot_env(node):
    return RobotEnv(node, Model('pendulum').robot)


def start(spawn, *parameters: str, name: str = 'robot'):
    return start_node(spawn, 'leo_sim', 'robot', 'robot:=pendulum', *parameters, name=name)


def test_lockstep_gives_the_models_transitions_and_other_robots_are_refused(
    robot_env, node, spawn
):
    start(spawn, LOCKSTEP)
    model_env = ModelEnv(Model('pendulum'))
    for _ in range(2):
        seen, _ = robot_env.reset()
        expected, _ = model_env.reset(options={'pose': 'nominal'})
        np.testing.assert_allclose(seen, expected, atol=1e-12)
        for volts in (1.0, -3.0, 0.5, 2.0, 9.0):
            answer = robot_env.step(np.array([volts]))
            expected = model_env.step(np.array([volts]))
            np.testing.assert_allclose(answer[0], expected[0], atol=1e-6)
            assert answer[1] == pytest.approx(expected[1], abs=1e-5)
            assert answer[2:] == expected[2:]
    other = RobotEnv(node, Model('servo_pendulum').robot)
    with pytest.raises(UserError, match="the running robot is 'pendulum', this is for 'servo_p"):
        other.reset()
    start(spawn, LOCKSTEP, name='robot2')
    with pytest.raises(UserError, match=r'two robots .* \(/robot, /robot2\)'):
        go_on(robot_env)


def go_on(env: RobotEnv) -> None:
    for _ in range(1000):
        env.reset()
        env.step(np.zeros(1))


def test_a_command_that_came_too_early_is_sent_again(robot_env, spawn):
    start(spawn, LOCKSTEP, 'state_rate:=4000')  # the last states count as the next
    robot_env.reset()
    stamps = [robot_env._state.stamp]
    for _ in range(3):
        assert robot_env.step(np.ones(1))[4] == {}
        stamps.append(robot_env._state.stamp)
    np.testing.assert_allclose(np.diff(stamps), 0.05, rtol=0.011)


def steps_in_time(env: RobotEnv) -> bool:
    """Whether twenty steps, each of 0.05 s, were twenty transitions and took a second."""
    env.reset()
    began = time.monotonic()
    rewards = [env.step(np.array([2.0]))[1] for _ in range(20)]
    took = time.monotonic() - began
    return 0.8 < took < 3.0 and len(set(rewards)) == 20


def test_real_time_steps_take_a_control_period(robot_env, spawn):
    start(spawn, 'realtime_factor:=1')
    end = time.monotonic() + PATIENCE
    while not steps_in_time(robot_env):  # on a busy machine the robot is late and catches up
        assert time.monotonic() < end


def test_a_restarted_robot_loses_the_episode_and_the_next_one_goes_on(robot_env, spawn):
    robot = start(spawn, LOCKSTEP)
    robot_env.reset()
    robot_env.step(np.zeros(1))
    robot.kill()
    robot.wait()
    start(spawn, LOCKSTEP)
    answer = robot_env.step(np.zeros(1))
    assert answer[3] and answer[4] == {'lost': True}
    robot_env.reset()
    assert robot_env.step(np.zeros(1))[4] == {}


def test_a_command_that_waits_for_a_robot_says_so_and_ends_quietly(spawn):
    process = commands.start(spawn, 'play', 'leo_walk', stderr=subprocess.PIPE)
    lines = iter(process.stderr.readline, '')
    assert any('waiting for the robot' in line for line in lines)
    process.send_signal(signal.SIGTERM)
    assert 'Traceback' not in process.stderr.read()
    assert process.wait(PATIENCE) == 130
