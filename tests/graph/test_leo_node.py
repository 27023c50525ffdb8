# SPDX-License-Identifier: Apache-2.0
"""LEO behind its node: lockstep, a held base, e-stop, free motors, and its bag."""

import signal

import numpy as np
import pytest
from tests import live_bag
from tests.commands import start_node
from tests.patience import PATIENCE

from leo_diffmodel.bags.recording import read_bag
from leo_learner.environment.env import ModelEnv
from leo_learner.environment.sym import Sym
from leo_learner.robot.env import RobotEnv
from leo_msgs_py import topics
from leo_msgs_py.node import call, spin_until
from leo_sim.description.robot import load_robot
from leo_sim.model import Model

pytestmark = pytest.mark.graph

LEO = load_robot('leo')
STATE_PERIOD_NS = round(1e9 / LEO.state_rate)
VOLTS = np.random.default_rng(0).uniform(-4.0, 4.0, (12, 6))


@pytest.fixture
def env(node):
    return RobotEnv(node, LEO)


def start(spawn, pose: str) -> None:
    given = 'robot:=leo', 'realtime_factor:=0', f'start:={pose}'
    start_node(spawn, 'leo_sim', 'robot', *given)


def test_lockstep_gives_the_models_transitions_with_all_motors_and_with_syms(env, spawn):
    start(spawn, 'nominal')
    model_env = ModelEnv(Model(LEO))
    robot, model = Sym(env), Sym(ModelEnv(Model(LEO)))
    for one, other, volts in ((env, model_env, VOLTS[:5]), (robot, model, VOLTS[:5, :3])):
        seen = [each.reset(options={'pose': 'nominal'})[0] for each in (one, other)]
        np.testing.assert_allclose(*seen, atol=1e-12)
        for row in volts:
            answer, expected = one.step(row), other.step(row)
            np.testing.assert_allclose(answer[0], expected[0], atol=0.02)
            assert answer[1] == pytest.approx(expected[1], abs=0.5)
            assert answer[2:] == expected[2:]
            assert env.applied == pytest.approx(other.unwrapped.applied, abs=0.02)
            assert robot.stance == model.stance


def asked(node, service, **request) -> bool:
    client = node.create_client(*service)
    return call(client, service.type.Request(**request), PATIENCE).success


def test_a_recording_of_a_held_robot_says_so_and_holds_it(node, env, spawn, tmp_path):
    start(spawn, 'hanging')
    bag = tmp_path / 'bag'
    recorder = start_node(spawn, 'leo_diffmodel', 'diffmodel', f'bag:={bag}')
    logs = topics.JOINT_STATES, topics.APPLIED['voltage'], topics.EPISODE

    def listens() -> bool:
        env.reset()
        env.step(VOLTS[0])
        return live_bag.has(bag, *logs)

    assert spin_until(listens, PATIENCE)
    env.reset()
    for volts in VOLTS:
        env.step(volts)
    assert asked(node, topics.E_STOP)
    env.step(VOLTS[0])
    assert asked(node, topics.E_STOP_RESET)
    assert asked(node, topics.TORQUE, data=False)
    for volts in VOLTS[:3]:
        env.step(volts)
    end = env._state.stamp_ns

    def complete() -> bool:
        state, applied = (live_bag.newest(bag, topic) for topic in logs[:2])
        return live_bag.says(bag, 'held') and min(state, applied + STATE_PERIOD_NS) >= end

    assert spin_until(complete, PATIENCE)
    recorder.send_signal(signal.SIGINT)
    assert recorder.wait(PATIENCE) in (0, 130)
    recording = read_bag(bag, LEO)
    assert recording.joints == LEO.joint_names
    assert len(recording.actuators) == 6
    assert recording.metadata['held'] == 'true'
    assert 'state_rate' not in recording.metadata, "0 stands for the robot's own"
    driven, free = recording.episodes[-2:]  # the end of an e-stop begins an episode
    assert (len(driven.t), len(free.t)) == (1 + 13 * 3, 3 * 3)
    for episode in (driven, free):
        np.testing.assert_array_equal(episode.q[:, :3], np.tile([0, 0.6, 0], (len(episode.t), 1)))
        assert not episode.dq[:, :3].any()
    held = driven.inputs[:36].reshape(12, 3, 6)
    np.testing.assert_allclose(held, np.repeat(VOLTS[:, None], 3, axis=1))
    assert driven.enabled[:36].all() and np.ptp(driven.q[:, 3:], axis=0).min() > 0.01
    assert not driven.inputs[36:].any()
    assert not free.enabled[-3:].any()
