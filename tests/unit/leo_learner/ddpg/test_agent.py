# SPDX-License-Identifier: Apache-2.0
"""DDPG: the thesis' numbers, learning, repeatability, and runs that go on where they were."""

from dataclasses import replace
import json

import numpy as np
import pytest
from tests.agents import Follow, same, SMALL
import torch

from leo_lab.autograd_update import AutogradUpdate
from leo_learner.ddpg.agent import Agent, OrnsteinUhlenbeck, Training
from leo_learner.ddpg.configs import THESIS
from leo_learner.learning.checkpoint import load_checkpoint, save_checkpoint, start_from
from leo_learner.learning.run import learn
from leo_learner.training.replay import Batch, Replay, Transition
from leo_msgs_py.errors import UserError
from leo_sim.description.robot import load_robot


def test_networks_start_as_in_the_thesis():
    agent = Agent(3, 1, THESIS, seed=0)
    first, second = (layer[0] for layer in agent.actor.hidden)
    assert first.weight.shape == (400, 3) and second.weight.shape == (300, 400)
    (critic,) = agent.critic.members
    assert critic.hidden[1][0].weight.shape == (300, 401)
    for layer, bound in (
        (first, 3**-0.5),
        (second, 400**-0.5),
        (agent.actor.output, 3e-3),
        (critic.hidden[1][0], 401**-0.5),
        (critic.output, 3e-3),
    ):
        assert 0.9 * bound < float(layer.weight.detach().abs().max()) <= bound
        assert not layer.bias.any()


def test_critic_is_decayed_and_the_actor_is_not():
    update = Agent(3, 1, THESIS, seed=0, update=AutogradUpdate).update
    groups = [adam.param_groups for adam in (update.actor_adam, update.critic_adam)]
    assert [[g['weight_decay'] for g in each] for each in groups] == [[0.0, 0.0], [0.01, 0.0]]
    assert [each[0]['lr'] for each in groups] == [1e-4, 1e-3]


def test_noise_follows_its_recursion():
    noise = OrnsteinUhlenbeck(2, 0.15, 0.2, np.random.default_rng(0))
    rng, expected = np.random.default_rng(0), np.zeros(2)
    for _ in range(5):
        expected = expected - 0.15 * expected + 0.2 * rng.normal(size=2)
        np.testing.assert_allclose(noise(), expected)


def test_bootstraps_unless_terminated():
    config = replace(THESIS, hidden=(8, 8), tau=0.0, critic_l2=0.0, critic_rate=0.01)
    agent = Agent(1, 1, config, seed=0)
    with torch.no_grad():
        agent.target_critic.members[0].output.bias.fill_(10.0)
    seen, ones = np.zeros((64, 1), np.float32), np.ones(64, np.float32)
    for terminated, value in ((1.0, 1.0), (0.0, 1.0 + 0.99 * 10.0)):
        batch = Batch(seen, seen, ones, seen, terminated * ones)
        for _ in range(1500):
            agent.learn(batch)
        zero = torch.zeros(1, 1)
        assert float(agent.critic(zero, zero).detach()) == pytest.approx(value, rel=0.05)


@pytest.mark.parametrize(
    'config', [SMALL, replace(THESIS, hidden=(32, 32), warm_up=64, actor_rate=1e-3, tau=0.01)]
)
def test_learns_to_follow(config):
    training = Training(Follow(), config, seed=0)
    training.run(3000)
    assert training.test(5).mean() > -0.3
    assert training.best_return >= -0.3


def test_learning_leaves_small_numbers_to_the_physics():
    agent = Agent(3, 1, SMALL, seed=0)
    seen, done, each = (np.ones(shape, np.float32) for shape in ((4, 3), (4, 1), (4,)))
    agent.learn(Batch(seen, done, each, seen, each))
    assert np.float64(5e-324) + 0.0 > 0.0


def test_start_from_keeps_scales_and_the_best_policy(tmp_path):
    trained = Training(Follow(), SMALL, seed=3)
    trained.run(400)
    save_checkpoint(tmp_path, trained)
    fresh = Training(Follow(), SMALL, seed=9)
    start_from(tmp_path, fresh)
    assert fresh.agent.scaled and len(fresh.replay) == 0
    kept, best = fresh.best, trained.best
    assert all(torch.equal(kept[name], best[name]) for name in best)
    scale = fresh.agent.observation_scale.clone()
    fresh.run(200)
    assert torch.equal(scale, fresh.agent.observation_scale)


def test_folder_run_writes_curves_policy_checkpoint(tmp_path):
    from tensorboard.backend.event_processing.event_accumulator import EventAccumulator

    robot = load_robot('pendulum')
    outcome = learn(Training(Follow(), SMALL, 0), robot, 200, tmp_path, quiet=True)
    events = EventAccumulator(str(tmp_path)).Reload()
    charts = {f'charts/{name}' for name in ('episodic_return', 'test_return', 'SPS')}
    losses = {f'losses/{name}' for name in ('qf_loss', 'qf_values', 'actor_loss')}
    assert charts | losses <= set(events.Tags()['scalars'])
    assert outcome.finished and outcome.steps == 200 and outcome.policy.is_file()
    assert learn(Training(Follow(), SMALL, 0), robot, 300, tmp_path, quiet=True).steps == 300
    assert json.loads(next(tmp_path.glob('checkpoint-*/run.json')).read_text())['steps'] == 300


def test_what_was_learned_is_saved_before_an_error(tmp_path):
    class Refused(Follow):
        def reset(self, **given):
            if training.steps == 50:
                raise UserError('two robots')
            return super().reset(**given)

    training = Training(Refused(), replace(SMALL, test_interval=1000), seed=0)
    with pytest.raises(UserError, match='two robots'):
        learn(training, load_robot('pendulum'), 200, tmp_path, quiet=True)
    assert (tmp_path / 'policy.safetensors').is_file()
    again = Training(Follow(), training.config, seed=0)
    load_checkpoint(tmp_path, again)
    assert again.steps == 50 and same(again, training)


def test_a_run_that_was_stopped_in_its_last_test_is_not_finished(tmp_path):
    class Stopped(Follow):
        def reset(self, **given):
            if training.steps == 100:
                raise KeyboardInterrupt
            return super().reset(**given)

    config, robot = replace(SMALL, test_interval=1000), load_robot('pendulum')
    training = Training(Stopped(), config, seed=0)
    outcome = learn(training, robot, 100, tmp_path, quiet=True)
    assert not outcome.finished and outcome.steps == 100
    outcome = learn(Training(Follow(), config, seed=0), robot, 100, tmp_path, quiet=True)
    assert outcome.finished and np.isfinite(outcome.test_return)


def test_replay_keeps_the_newest(tmp_path):
    replay = Replay(5, 1, 1)
    for k in range(8):
        replay.add(Transition(np.array([k]), np.array([0.0]), float(k), np.array([k + 1]), False))
    assert sorted(replay.all().rewards) == [3, 4, 5, 6, 7]
    replay.save(tmp_path / 'replay.npz')
    again = Replay(5, 1, 1)
    again.load(tmp_path / 'replay.npz')
    again.add(Transition(np.array([8]), np.array([0.0]), 8.0, np.array([9]), False))
    assert sorted(again.all().rewards) == [4, 5, 6, 7, 8]
    with pytest.raises(UserError, match='shape'):
        Replay(5, 2, 1).load(tmp_path / 'replay.npz')
    with pytest.raises(UserError, match='holds 5'):
        Replay(4, 1, 1).load(tmp_path / 'replay.npz')
