# SPDX-License-Identifier: Apache-2.0
"""Algorithm 5: who drives the robot, when it ends, what it starts from."""

from dataclasses import replace
from types import SimpleNamespace
from unittest.mock import MagicMock

import pytest
from std_msgs.msg import UInt8MultiArray

from leo_diffmodel.difference.data import transitions
from leo_diffmodel.difference.fit import fit
from leo_diffmodel.difference.job import NOT_BETTER
from leo_diffmodel.difference.network import RECOMMENDED as NETWORK
from leo_lab.thesis.table7 import effects
from leo_learner import algorithm5
from leo_learner.algorithm5 import Algorithm5, Settings
from leo_learner.ddpg.agent import Training
from leo_learner.ddpg.configs import RECOMMENDED, RECOMMENDED_WALKING, THESIS_WALKING
from leo_learner.environment.env import ModelEnv, training_env
from leo_learner.environment.rollouts import Rollouts
from leo_learner.learning.checkpoint import save_checkpoint
from leo_learner.learning.policy import driven, save_policy
from leo_learner.learning.run import POLICY
from leo_learner.nodes.learner import checked, DifferenceClient
from leo_learner.training.loop import play
from leo_msgs_py.errors import UserError
from leo_sim.description.robot import load_robot
from leo_sim.model import Model

PENDULUM = replace(load_robot('pendulum'), episode_seconds=5.0)
SMALL = replace(RECOMMENDED, hidden=(8, 8), warm_up=64, test_interval=2, test_starts=1)
SETTINGS = Settings(updates=4, first_steps=120, update_steps=120, transitions=60, tests=1)


class Fitting:
    def __init__(self, robot: Rollouts) -> None:
        self._robot, self._newest, self.samples = robot, None, []

    def newer(self, version: int) -> bytes:
        steps = transitions([self._robot.recording()], Model(PENDULUM))
        self.samples.append(len(steps))
        config = replace(NETWORK, hidden=(8,), members=2, epochs=2)
        self._newest, _ = fit(steps, Model(PENDULUM), config, start=self._newest)
        return self._newest.to_bytes()


@pytest.fixture
def loop(tmp_path, monkeypatch):
    """Algorithm 5 on a heavier pendulum; the returns of its tests there are given."""
    ideal = Model(PENDULUM)
    robot = Rollouts(ModelEnv(ideal.changed(effects=effects(ideal.robot, 'moved'))))
    said: list[str] = []

    def made(returns=None, start=None, folder='run', **changed) -> Algorithm5:
        if returns is not None:
            given = iter(returns)
            monkeypatch.setattr(algorithm5, 'play', lambda *a, **k: play(*a) * 0 + next(given))
        made.source, settings = Fitting(robot), replace(SETTINGS, **changed)
        parts = tmp_path / folder, ideal, SMALL, settings, robot, made.source
        return Algorithm5(*parts, say=said.append, start=start)

    made.said, made.folder = said, tmp_path
    return made


def test_a_worse_policy_does_not_take_over_and_two_without_gain_end_it(loop):
    algorithm = loop([-300.0, -200.0, -250.0, -201.0, -100.0])
    assert algorithm.run()
    done = algorithm.done
    assert done.tests == [-300.0, -200.0, -250.0, -201.0] and done.driver == 1
    assert algorithm.best == loop.folder / 'run' / 'round-1' / 'policy.safetensors'
    assert any('worse than -200.0: the policy of round 1' in line for line in loop.said)


def test_an_equal_policy_takes_over_but_is_no_gain(loop):
    algorithm = loop([-300.0, -300.0, -300.0])
    assert algorithm.run()
    assert algorithm.done.driver == 2 and len(algorithm.done.tests) == 3


def test_every_step_of_the_robot_is_counted_and_fitted(loop):
    algorithm = loop([-3.0, -2.0, -1.0, -1.0, -1.0])
    assert algorithm.run()
    per_test, gathered = algorithm.robot.env.episode_steps, SETTINGS.transitions
    assert algorithm.done.samples == 5 * per_test + 4 * gathered
    in_first_fit = per_test + gathered
    assert 0.9 * in_first_fit < loop.source.samples[0] <= in_first_fit


def test_the_first_training_may_be_a_run_that_is_there(loop):
    first = loop([-300.0, -200.0, -250.0, -260.0])
    assert first.run()
    start = loop.folder / 'run' / 'round-0'
    second = loop([-50.0, -60.0, -70.0], start=start, folder='again')
    assert second.done.phase == 'test' and second.run()
    assert second.best == start / 'policy.safetensors'
    assert not (loop.folder / 'again' / 'round-0').exists()


def test_a_run_goes_on_with_the_phase_it_was_in(loop):
    algorithm = loop([-300.0])
    with pytest.raises((StopIteration, RuntimeError)):
        algorithm.run()
    again = loop([-200.0, -250.0, -260.0])
    assert (again.done.tests, again.done.phase) == ([-300.0], 'test')
    before = again.done.seconds
    assert again.run() and again.done.tests == [-300.0, -200.0, -250.0, -260.0]
    assert 0 < before < again.done.seconds


def test_a_training_that_is_stopped_goes_on_and_its_time_counts(loop):
    algorithm = loop([-300.0, -200.0, -250.0, -260.0])
    algorithm.alive = lambda: False
    assert not algorithm.run()
    again = loop([-300.0, -200.0, -250.0, -260.0])
    assert (again.done.phase, again.done.update) == ('train', 0)
    assert again.done.seconds == algorithm.done.seconds > 0
    assert again.run() and len(again.done.tests) == 4


def test_more_updates_may_be_asked_for_but_not_another_run(loop):
    assert loop([-300.0, -200.0], updates=1).run()
    with pytest.raises(UserError, match='another seed'):
        loop(updates=1, seed=4)
    algorithm = loop(updates=1)
    heavier = algorithm.model.changed(constants={'links.bob.mass': 0.12})
    with pytest.raises(UserError, match=r'another links\.bob\.mass'):
        replace(algorithm, model=heavier)
    more = loop([-250.0, -260.0], updates=4)
    assert more.done.phase == 'collect' and more.run()
    assert more.done.tests == [-300.0, -200.0, -250.0, -260.0]
    (loop.folder / 'run' / algorithm5.DONE).write_text('{"update": 1')
    with pytest.raises(UserError, match=r'algorithm5\.json cannot be read'):
        loop()


def test_what_was_gathered_may_be_gathered_again(loop):
    algorithm = loop([-300.0])
    assert algorithm._train() and algorithm._test() and algorithm._collect()
    samples = algorithm.done.samples
    algorithm.gather_again()
    assert algorithm.done.phase == 'collect' and algorithm._collect()
    assert algorithm.done.samples == samples


class Answers(DifferenceClient):
    def __init__(self, model, answers=()) -> None:
        super().__init__(MagicMock(), model)
        self.answers = iter(answers)

    def _ask(self) -> None:
        success, message = next(self.answers)
        answer = SimpleNamespace(success=success, message=message)
        self._on_answer(SimpleNamespace(result=lambda: answer))


def test_an_update_that_came_to_nothing_ends_the_learner_but_not_one_of_before(monkeypatch):
    failed = f'accepted; the last one failed: it {NOT_BETTER}'
    client = Answers(Model(PENDULUM), [(True, failed), (False, 'busy'), (True, failed)])
    monkeypatch.setattr('leo_learner.nodes.learner.ASK_AGAIN', 0.0)
    monkeypatch.setattr('leo_learner.nodes.learner.nodes.running', lambda: True)
    monkeypatch.setattr('leo_learner.nodes.learner.nodes.spin_once', lambda: None)
    with pytest.raises(UserError, match='the policies learned so far stay'):
        client.newer(0)
    assert list(client.answers) == []


def test_weights_that_do_not_go_with_the_model_are_ignored(loop):
    ideal = Model(PENDULUM)
    play(loop().robot, lambda seen: seen[:1], 1)
    weights = loop.source.newer(0)
    for model, data, version in (
        (ideal.changed(constants={'links.bob.mass': 0.12}), weights, 0),
        (ideal, weights.replace(b'"trained_on"', b'"trained_by"'), 0),
        (ideal, weights, 1),
    ):
        client = Answers(model)
        client._on_weights(UInt8MultiArray(data=data))
        assert client._version == version
        assert client._node.get_logger().error.called == (version == 0)


@pytest.mark.parametrize(
    'make',
    [
        lambda env: Training(driven(env, 'sym'), RECOMMENDED_WALKING, 0),
        lambda env: Training(env, THESIS_WALKING, 0),
    ],
)
def test_the_learner_starts_only_from_what_it_can_go_on_with(tmp_path, make):
    training, robot = make(training_env(Model('leo_ode'))), load_robot('leo_ode')
    save_checkpoint(tmp_path, training)
    save_policy(tmp_path / POLICY, training, robot)
    with pytest.raises(UserError, match=r'cannot go on|another configuration'):
        checked(str(tmp_path), robot, RECOMMENDED_WALKING)
    assert checked('', robot, RECOMMENDED_WALKING) is None
