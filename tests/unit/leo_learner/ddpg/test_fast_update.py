# SPDX-License-Identifier: Apache-2.0
"""The update that trains gives what autograd gives, for every option."""

from dataclasses import replace
from functools import partial

import numpy as np
import pytest
import torch

from leo_lab.autograd_update import AutogradUpdate
from leo_learner.ddpg.agent import Agent
from leo_learner.ddpg.configs import Config, THESIS
from leo_learner.training.replay import Batch

N_OBS, N_ACT = 5, 2
SMALL = replace(THESIS, hidden=(24, 16), tau=0.05, critic_l2=0.01)
OPTIONS = [
    SMALL,
    replace(SMALL, layer_norm=True),
    replace(SMALL, twin_critics=True),
    replace(SMALL, layer_norm=True, twin_critics=True, hidden=(24, 20, 16)),
    replace(SMALL, hidden=(24,)),
]
MODULES = ('actor', 'critic', 'target_actor', 'target_critic')
close = partial(torch.testing.assert_close, rtol=1e-4, atol=1e-6)


def batch(seed: int, size: int = 32) -> Batch:
    rng = np.random.default_rng(seed)
    columns = (
        rng.normal(size=(size, N_OBS)),
        rng.uniform(-1, 1, (size, N_ACT)),
        rng.normal(size=size),
        rng.normal(size=(size, N_OBS)),
        rng.random(size) < 0.2,
    )
    return Batch(*(column.astype(np.float32) for column in columns))


def agents(config: Config) -> tuple[Agent, Agent]:
    """One that autograd updates, one as it trains; their scales are not one."""
    made = Agent(N_OBS, N_ACT, config, 7, AutogradUpdate), Agent(N_OBS, N_ACT, config, 7)
    for agent in made:
        agent.observation_scale = torch.linspace(0.5, 2.0, N_OBS)
        agent.reward_scale = torch.tensor(0.3)
    return made


@pytest.mark.parametrize('config', OPTIONS, ids=str)
def test_ten_updates_are_those_of_autograd(config):
    plain, fast = agents(config)
    for seed in range(10):
        close(fast.learn(batch(seed)), plain.learn(batch(seed)))
    for module in MODULES:
        close(*(getattr(agent, module).state_dict() for agent in (fast, plain)))


def test_loading_weights_reaches_what_learns():
    trained, fresh = (Agent(N_OBS, N_ACT, SMALL, seed) for seed in (1, 2))
    trained.learn(batch(0))
    for module in MODULES:
        getattr(fresh, module).load_state_dict(getattr(trained, module).state_dict())
    before = [p.clone() for p in fresh.target_actor.parameters()]
    fresh.learn(batch(1))
    after = list(fresh.target_actor.parameters())
    assert all((a != b).any() for a, b in zip(before, after, strict=True))
    seen = np.ones(N_OBS, np.float32)
    assert not np.allclose(fresh.act(seen), trained.act(seen), atol=1e-7)


@pytest.mark.parametrize('config', OPTIONS[2:4], ids=str)
def test_a_run_goes_on_in_the_other_agent(config):
    plain, fast = agents(config)
    for agent, other in ((plain, fast), (fast, plain)):
        for seed in range(3):
            agent.learn(batch(seed))
        other.load({name: tensor.clone() for name, tensor in agent.tensors().items()})
        for each in (plain, fast):
            each.learn(batch(9))
        close(plain.tensors(), fast.tensors())


def test_an_agent_that_has_not_learned_takes_away_what_was_remembered():
    plain, fast = agents(SMALL)
    initial = {name: tensor.clone() for name, tensor in plain.tensors().items()}
    fast.learn(batch(1))
    fast.load(initial)
    for agent in (plain, fast):
        agent.learn(batch(0))
    close(fast.tensors(), plain.tensors())


@pytest.mark.parametrize('config', OPTIONS[:2], ids=str)
def test_it_acts_as_its_actor_network(config):
    seen = np.linspace(-1, 1, N_OBS)
    for agent in agents(config):
        agent.learn(batch(0))
        with torch.no_grad():
            scaled = torch.from_numpy(seen).float() * agent.observation_scale
            action = agent.actor(scaled).numpy()
        np.testing.assert_allclose(agent.act(seen), action, rtol=1e-5, atol=1e-7)
