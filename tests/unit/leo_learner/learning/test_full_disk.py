# SPDX-License-Identifier: Apache-2.0
"""A disk that fills while a policy is learned: one line, and the last checkpoint stays."""

import pytest
from tests.damage import room_for

from leo_learner.ddpg.agent import Training
from leo_learner.ddpg.configs import RECOMMENDED
from leo_learner.environment.env import ModelEnv
from leo_learner.learning.checkpoint import load_checkpoint, save_checkpoint
from leo_learner.learning.policy import save_policy
from leo_msgs_py.errors import UserError
from leo_sim.description.robot import load_robot
from leo_sim.model import Model

ROBOT = load_robot('pendulum')


def training() -> Training:
    return Training(ModelEnv(Model(ROBOT)), RECOMMENDED, seed=3)


@pytest.mark.parametrize('size', [10, 4096])
def test_the_checkpoint_before_stays(tmp_path, size):
    run = training()
    run.run(100)
    kept = save_checkpoint(tmp_path, run)
    run.run(200)
    with room_for(size), pytest.raises(UserError, match='make room, then go on with: leo learn'):
        save_checkpoint(tmp_path, run)
    assert list(tmp_path.iterdir()) == [kept]
    again = training()
    load_checkpoint(tmp_path, again)
    assert again.steps < run.steps


def test_where_nothing_was_saved_it_says_so(tmp_path):
    with room_for(10), pytest.raises(UserError, match='nothing was saved'):
        save_checkpoint(tmp_path, training())


def test_a_policy_that_cannot_be_written_leaves_the_one_before(tmp_path):
    path, run = tmp_path / 'policy.safetensors', training()
    save_policy(path, run, ROBOT)
    before = path.read_bytes()
    with room_for(10), pytest.raises(OSError, match=r'policy\.safetensors'):
        save_policy(path, run, ROBOT)
    assert path.read_bytes() == before and list(tmp_path.iterdir()) == [path]
