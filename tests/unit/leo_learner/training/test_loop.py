# SPDX-License-Identifier: Apache-2.0
"""What holds for every agent: repeatability, runs that go on where they were, lost steps."""

from dataclasses import replace

import gymnasium
import pytest
from tests.agents import Corridor, FEW_TILES, Follow, same, SMALL

from leo_lab.thesis import sarsa
from leo_learner.ddpg.agent import Training
from leo_learner.ddpg.configs import THESIS
from leo_learner.learning.checkpoint import load_checkpoint, save_checkpoint
from leo_learner.training.loop import TrainingLoop
from leo_msgs_py.errors import UserError

THESIS_SMALL = replace(THESIS, hidden=(32, 32), warm_up=64)
AGENTS = [
    (Training, Follow, SMALL),
    (Training, Follow, THESIS_SMALL),
    (sarsa.Training, Corridor, FEW_TILES),
]


@pytest.fixture(params=AGENTS, ids=['ddpg', 'thesis', 'sarsa'])
def made(request):
    kind, place, config = request.param

    def make(seed: int, env: gymnasium.Env | None = None, **changes) -> TrainingLoop:
        return kind(env or place(), replace(config, **changes), seed)

    make.place = place
    return make


def test_same_seed_same_weights(made):
    first, again, other = (made(seed) for seed in (1, 1, 2))
    for training in (first, again, other):
        training.run(300)
    assert same(first, again) and not same(first, other)


def test_resumes_exactly(made, tmp_path):
    whole, first, second = (made(3) for _ in range(3))
    whole.run(600)
    first.run(250)
    save_checkpoint(tmp_path, first)
    load_checkpoint(tmp_path, second)
    second.run(600)
    assert same(whole, second)
    assert (second.steps, second.best_return) == (whole.steps, whole.best_return)
    assert (second.replay is None) or len(second.replay) == len(whole.replay)


def test_checkpoint_of_another_run_is_refused(made, tmp_path):
    save_checkpoint(tmp_path, made(3))
    for folder, other, said in (
        (tmp_path, made(4), 'another seed'),
        (tmp_path, made(3, gamma=0.5), 'another config'),
        (tmp_path / 'none', made(3), 'no checkpoint'),
    ):
        with pytest.raises(UserError, match=said):
            load_checkpoint(folder, other)


def test_spoilt_checkpoint_is_one_line(made, tmp_path):
    folder = save_checkpoint(tmp_path, made(3))
    counters, tensors = folder / 'run.json', folder / 'agent.safetensors'
    whole = counters.read_bytes()
    for file, text in (
        (counters, whole.replace(b'"steps": 0', b'"steps": "abc"')),
        (tensors, b'no tensors'),
        (tensors, tensors.read_bytes()[:-1]),
    ):
        before = file.read_bytes()
        file.write_bytes(text)
        with pytest.raises(UserError, match='cannot be read'):
            load_checkpoint(tmp_path, made(3))
        file.write_bytes(before)


def test_a_lost_step_is_not_learned(made):
    class Losing(made.place):
        def step(self, action):
            result = super().step(action)
            return (*result[:4], {'lost': True}) if self.steps == 5 else result

    training = made(0, Losing(), test_interval=1000)
    training._train_episode(lambda name, value, step: None)
    learned = training._traced if training.replay is None else len(training.replay)
    assert training.steps == learned == 4
