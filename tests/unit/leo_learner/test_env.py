# SPDX-License-Identifier: Apache-2.0
"""The model as an environment, policy files, and the verbs' answers to bad input."""

from dataclasses import replace
import json
import os
import shutil
import signal
import threading
import time

from gymnasium.utils.env_checker import check_env
import numpy as np
import pytest
from safetensors import safe_open
from safetensors.torch import save_file
from tests.difference import untrained

from leo_diffmodel.difference.model import DifferenceModel, load_difference
from leo_diffmodel.difference.trust import Trust
from leo_learner.ddpg.agent import Training
from leo_learner.ddpg.configs import RECOMMENDED
from leo_learner.environment.env import model_env, ModelEnv, training_env
from leo_learner.environment.rollouts import Recorded
from leo_learner.learning.checkpoint import load_checkpoint, save_checkpoint
from leo_learner.learning.collect import collect
from leo_learner.learning.policy import observation_names, Policy, save_policy
from leo_learner.learning.run import learn
from leo_learner.robot.env import Stopped
from leo_learner.training.loop import play
from leo_learner.verbs import learn as learn_verb
from leo_learner.verbs import play as play_verb
from leo_msgs_py.errors import UserError
from leo_sim.description.robot import load_robot
from leo_sim.effects import place
from leo_sim.model import Model
from leo_sim.model.model_file import load_model, save_model


@pytest.fixture(scope='module')
def model() -> Model:
    return Model('pendulum')


def shifted(model: Model, shift: float) -> DifferenceModel:
    """d(s, a): the rate is off by `shift` rad/s."""
    difference = untrained(model, dropout=0.0)
    for parameter in difference.network.parameters():
        parameter.data.zero_()
    difference.network.layers[-1].bias.data[2] = shift
    return replace(difference, over={})


@pytest.fixture
def policy(model, tmp_path):
    training = Training(ModelEnv(model), RECOMMENDED, seed=0)
    save_policy(tmp_path / 'policy.safetensors', training, model.robot)
    return tmp_path / 'policy.safetensors'


@pytest.mark.filterwarnings('ignore:.*Box.*')
def test_passes_gymnasiums_checker(model):
    check_env(ModelEnv(model), skip_render_check=True)


def test_step_is_the_models(model):
    env = ModelEnv(model)
    env.reset(options={'pose': 'nominal'})
    observation, reward, terminated, truncated, info = env.step(np.array([5.0]))
    after = model.step(model.start(), [3.0], 0.05)
    angle = np.angle(np.exp(1j * after.q[0]))
    assert observation.tolist() == [np.cos(after.q[0]), np.sin(after.q[0]), after.dq[0]]
    assert reward == pytest.approx(-5 * angle**2 - 0.1 * after.dq[0] ** 2 - 0.01 * 9)
    assert not terminated and not truncated and info == {}


def test_episode_is_twenty_seconds(model):
    env = ModelEnv(model)
    env.reset(seed=0)
    assert [env.step(np.zeros(1))[3] for _ in range(400)] == [False] * 399 + [True]


def test_corrected_state_is_the_next_ones_start(model):
    env = ModelEnv(model, shifted(model, 0.5))
    env.reset(options={'pose': 'nominal'})
    first, reward, *_ = env.step(np.zeros(1))
    assert first[2] == pytest.approx(0.5, abs=1e-6)
    assert reward == pytest.approx(-5 * np.pi**2 - 0.1 * 0.5**2, rel=1e-6)
    second, *_ = env.step(np.zeros(1))
    following = model.step(model.state_from([np.pi], [0.5]), [0.0], 0.05)
    assert second[2] == pytest.approx(following.dq[0] + 0.5, abs=1e-5)


def test_difference_model_of_the_model_file_is_used(model, tmp_path):
    path = tmp_path / 'difference.safetensors'
    path.write_bytes(shifted(model, 0.5).to_bytes())
    assert model_env(model.changed(difference_model=path)).difference is not None
    with pytest.raises(UserError, match='no difference model'):
        model_env(model.changed(difference_model=tmp_path / 'none'))


def test_policy_file_gives_the_same_volts(model, policy):
    training = Training(ModelEnv(model), RECOMMENDED, seed=0)
    loaded = Policy.load(policy)
    seen = np.array([0.3, -0.2, 4.0])
    np.testing.assert_allclose(loaded(seen), training.agent.act(seen) * 3.0, rtol=1e-6)
    assert loaded(np.tile(seen, (5, 1))).shape == (5, 1)
    assert loaded.observation == ('cos(pivot)', 'sin(pivot)', 'rate(pivot)')
    assert loaded.unit == 'V' and json.loads(loaded.metadata['config'])['hidden'] == [64, 64]


def test_policy_of_another_robot_or_no_policy(policy, model, tmp_path):
    with pytest.raises(UserError, match="of robot 'pendulum'"):
        Policy.load(policy).check(load_robot('torque_pendulum'))
    (tmp_path / 'text').write_text('text')
    (tmp_path / 'other').write_bytes(shifted(model, 0.5).to_bytes())
    for file, said in (('none', 'no such f'), ('text', 'not a policy'), ('other', 'not a policy')):
        with pytest.raises(UserError, match=said):
            Policy.load(tmp_path / file)
    assert len(observation_names(model.robot)) == 3


def respelled(policy, target, weights=None, **texts):
    with safe_open(policy, framework='pt') as file:
        metadata = file.metadata()
        tensors = {name: file.get_tensor(name) for name in file.keys()}  # noqa: SIM118
    if weights is not None:
        tensors['output.bias'][0] = weights
    save_file(tensors, target, metadata | texts)
    return target


NO_LIMITS = '[NaN]', '[Infinity]', '[0]', '[-3]', '3', '[[3]]', '[]', f'[{10**400}]', '"3"', 'null'


@pytest.mark.parametrize(
    ('changed', 'said'),
    [
        *(({'limit': text}, 'not a policy file') for text in NO_LIMITS),
        ({'agent': 'sarsa'}, r"not a policy file \(its agent is 'sarsa', .*; give the policy"),
        ({'weights': float('nan')}, r'output\.bias has numbers that are none'),
        ({'weights': float('inf')}, r'output\.bias has numbers that are none'),
        ({'limit': '[1e308]'}, 'drives with up to 1e.*give a policy'),
        ({'limit': '[1e3]'}, 'up to 1000 V'),
    ],
)
def test_a_policy_that_drives_no_robot_or_a_stronger_one(changed, said, policy, model, tmp_path):
    with pytest.raises(UserError, match=said):
        Policy.load(respelled(policy, tmp_path / 'other', **changed)).check(model.robot)
    Policy.load(policy).check(model.robot)


def test_a_policy_of_another_unit_or_period_is_refused_and_old_ones_have_none(policy, model):
    loaded, robot = Policy.load(policy), model.robot
    for other, said in (({'input': 'torque'}, 'V, here N'), ({'control_period': 0.01}, '0.05 s')):
        with pytest.raises(UserError, match=said):
            loaded.check(replace(robot, **other))
    old = {name: text for name, text in loaded.metadata.items() if name != 'control_period'}
    replace(loaded, metadata=old).check(replace(robot, control_period=0.01))


RUBS = place(load_robot('pendulum'), 'viscous_friction', 'pivot', b=1e-4)


@pytest.mark.parametrize(
    ('other', 'said'),
    [
        ({'constants': {'links.bob.mass': 0.12}}, r'another links\.bob\.mass \(0.055 kg, here'),
        ({'effects': [RUBS]}, 'none'),
    ],
)
def test_a_run_goes_on_only_on_the_model_it_was_begun_on(other, said, model, tmp_path):
    save_checkpoint(tmp_path, Training(ModelEnv(model), RECOMMENDED, seed=0))
    load_checkpoint(tmp_path, Training(training_env(model), RECOMMENDED, seed=0))
    with pytest.raises(UserError, match=said):
        load_checkpoint(tmp_path, Training(ModelEnv(model.changed(**other)), RECOMMENDED, seed=0))
    corrected = Training(ModelEnv(model, shifted(model, 0.5)), RECOMMENDED, seed=0)
    with pytest.raises(UserError, match='another difference model'):
        load_checkpoint(tmp_path, corrected)


def test_returns_repeat_and_collecting_counts(model):
    env, act = ModelEnv(model), lambda seen: np.array([1.0])
    assert np.array_equal(play(env, act, 2, seed=4), play(env, act, 2, seed=4))
    driven: list[int] = []
    collect(env, act, 450, on_step=lambda: driven.append(1))
    assert len(driven) == 450


@pytest.mark.parametrize(
    'argv, words',
    [
        (['--robot', 'pendulum'], '-o DIR'),
        (['--robot', 'pendulm', '-o', 'x'], 'pendulum'),
        (['--steps', '0', '-o', 'x'], '--steps'),
        (['-o', 'x', '--actions', 'sym', '--robot', 'pendulum'], "'pendulum' is no LEO"),
    ],
)
def test_learn_says_what_is_wrong(argv, words, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    with pytest.raises(UserError, match=words) as error:
        learn_verb.main(argv)
    assert '\n' not in str(error.value)
    assert not list(tmp_path.iterdir())


def test_learn_and_play(tmp_path, capsys):
    folder = tmp_path / 'run'
    assert learn_verb.main(['--model', 'pendulum', '--steps', '60', '-o', str(folder)]) == 0
    policy = folder / 'policy.safetensors'
    assert capsys.readouterr().out.splitlines()[-1] == f'next: leo play {policy} --model pendulum'
    assert learn_verb.main(['--resume', str(folder), '--steps', '200', '--json']) == 0
    told = json.loads(capsys.readouterr().out.splitlines()[-1])
    assert told['steps_done'] == 200 and told['finished'] and told['policy'] == str(policy)
    with pytest.raises(UserError, match='holds a run already'):
        learn_verb.main(['-o', str(folder)])
    assert play_verb.main([told['policy'], '--model', 'pendulum', '--json']) == 0
    played = json.loads(capsys.readouterr().out.splitlines()[-1])
    assert played['mean'] == played['returns'][0] < -1000
    for argv, words in ((['--episodes', '0'], '1 or more'), (['--seed', '-1'], '0 or more')):
        with pytest.raises(UserError, match=words):
            play_verb.main([told['policy'], '--model', 'pendulum', *argv])


def test_a_run_goes_on_as_it_was_begun_and_without_the_one_it_began_from(tmp_path):
    first, second = (str(tmp_path / name) for name in ('first', 'second'))
    assert learn_verb.main(['--steps', '60', '-o', first, '--json']) == 0
    assert learn_verb.main(['--start', first, '--steps', '60', '-o', second, '--json']) == 0
    shutil.rmtree(first)
    assert learn_verb.main(['--resume', second, '--steps', '90', '--json']) == 0
    file = tmp_path / 'second' / 'run.json'
    before = file.read_text()
    for argv, words in (
        (['--steps', '-5'], '--steps must be 1'),
        (['--seed', '0'], '--seed cannot be changed'),
        (['--config', 'thesis'], '--config cannot be changed'),
    ):
        with pytest.raises(UserError, match=words):
            learn_verb.main(['--resume', second, *argv])
        assert file.read_text() == before
    others = ({'steps': 'abc'}, {'agent': 'sarsa'}, {'actions': 'all'}, {'config': 'best'})
    spoilt = [json.dumps(json.loads(before) | other) for other in others]
    for text in ('', '[]', '{"model": "pendulum"}', *spoilt):
        file.write_text(text)
        with pytest.raises(UserError, match=r'run\.json cannot be read'):
            learn_verb.main(['--resume', second])


def test_an_environment_that_stops_waiting_ends_the_run_and_it_is_saved(model, tmp_path):
    class Gone(ModelEnv):
        left = 150

        def step(self, action):
            self.left -= 1
            if self.left < 0:
                raise Stopped
            return super().step(action)

    training = Training(Gone(model), RECOMMENDED, seed=0)
    outcome = learn(training, model.robot, 1000, tmp_path, quiet=True)
    assert (outcome.finished, outcome.steps) == (False, 150)
    again = Training(ModelEnv(model), RECOMMENDED, seed=0)
    load_checkpoint(tmp_path, again)
    assert again.steps == 150 and outcome.policy.is_file()


def test_ctrl_c_saves_and_ends_with_130(tmp_path, capsys):
    def interrupt() -> None:
        while signal.getsignal(signal.SIGINT) is signal.default_int_handler:
            time.sleep(0.01)
        os.kill(os.getpid(), signal.SIGINT)

    helper = threading.Thread(target=interrupt)
    helper.start()
    argv = ['--robot', 'pendulum', '--steps', '100000', '-o', str(tmp_path)]
    assert learn_verb.main(argv) == 130
    helper.join()
    assert f'leo learn --resume {tmp_path}' in capsys.readouterr().out
    assert list(tmp_path.glob('checkpoint-*'))


def unsure(model: Model, form: str = 'torque') -> DifferenceModel:
    """An ensemble of two that say 1 mN m +- 0.1, and disagree more the faster it turns."""
    kind = {'activation': 'relu', 'dropout': 0.0, 'stop_on': 0.5, 'members': 2, 'form': form}
    difference = untrained(model, **kind)
    network = difference.network
    for parameter in network.parameters():
        parameter.data.zero_()
    network.layers[0].weight.data[0, 2, 0] = 1.0  # relu of the rate, of the first member alone
    network.layers[-1].weight.data[0, 0, 0] = 1e-4
    network.layers[-1].bias.data[:] = 1e-3
    one = np.ones(1)
    trust = Trust(one, one * 1e-4, one * 2.0, one * 2e-3)
    return replace(difference, trust=trust, over={})


def test_torque_form_acts_as_a_push_inside_the_step(model):
    env = ModelEnv(model, unsure(model))
    env.reset(options={'pose': 'nominal'})
    *_, info = env.step(np.ones(1))
    after = model.step(model.start(), [1.0], 0.05, push=np.array([1e-3]))
    np.testing.assert_allclose(env.state.dq, after.dq, rtol=1e-5)
    assert info['factor'] == 1.0 and info['channel'] == 0


def test_play_says_when_the_data_were_left(model, policy, tmp_path, capsys):
    path = tmp_path / 'difference.safetensors'
    path.write_bytes(unsure(model).to_bytes())
    argv = [str(policy), '--model', 'pendulum', '--difference', str(path)]
    env = Recorded(ModelEnv(model, unsure(model)), unsure(model))
    play(env, lambda seen: np.array([3.0]), 1)
    left = env.left()[0]
    assert left.channel == 'pivot torque' and 0 < left.seconds < 2 and 0 < left.share < 1
    assert 'left the data of the difference model after' in str(left)
    elsewhere = Recorded(ModelEnv(model), unsure(model))
    play(elsewhere, lambda seen: np.array([3.0]), 1)
    assert elsewhere.left()[0].channel == 'pivot torque'
    assert play_verb.main([*argv, '--json']) == 0
    told = json.loads(capsys.readouterr().out.splitlines()[-1])
    assert told['difference'] == str(path) and len(told['left_data']) == 1
    assert play_verb.main(argv) == 0
    assert 'episode 1: ' in capsys.readouterr().out
    path.write_bytes(shifted(model, 0.5).to_bytes())
    assert play_verb.main(argv) == 0
    assert 'a single network' in capsys.readouterr().out


@pytest.mark.parametrize('where', [[], ['--model', 'pendulum']])
def test_play_says_what_is_wrong_with_a_difference_model(policy, where):
    with pytest.raises(UserError, match='no difference model x') as error:
        play_verb.main([str(policy), *where, '--difference', 'x'])
    assert '\n' not in str(error.value)


def test_a_difference_model_of_another_robot_is_refused(model, tmp_path):
    path = tmp_path / 'difference.safetensors'
    path.write_bytes(unsure(model).to_bytes())
    with pytest.raises(UserError, match=r'another robot \(pendulum, here torque_pendulum\)'):
        load_difference(path, Model('torque_pendulum'))


def test_a_difference_model_goes_on_top_of_the_effects_named_before_it(model, tmp_path):
    repaired = model.changed(effects=[place(model.robot, 'viscous_friction', 'pivot', b=1e-5)])
    text = save_model(tmp_path / 'difference.yaml', repaired).read_text()
    path = tmp_path / 'difference.safetensors'
    path.write_bytes(replace(unsure(model), base=text).to_bytes())
    assert load_difference(path, load_model(tmp_path / 'difference.yaml')).base == text
    said = r'viscous_friction at pivot b=1e-05, here none\); .*\(difference.yaml\)'
    with pytest.raises(UserError, match=said):
        load_difference(path, model)


@pytest.fixture(scope='module', params=['leo', 'leo_ode'])
def env(request):
    return ModelEnv(Model(request.param, engine='mujoco'))


def test_random_voltages_make_it_fall(env):
    env.action_space.seed(0)
    ends = []
    for seed in range(5):
        seen, _ = env.reset(seed=seed)
        assert seen.shape == env.observation_space.shape == (14,)
        fallen, rewards = False, []
        while not fallen:
            seen, reward, fallen, over, _ = env.step(env.action_space.sample())
            rewards.append(reward)
            assert np.isfinite([*seen, reward]).all()
            assert not over
        assert rewards[-1] < -70
        ends.append(len(rewards))
    assert min(ends) > 3


def test_an_episode_is_as_long_as_in_the_thesis(env):
    assert env.episode_steps == {'leo': 667, 'leo_ode': 833}[env.robot.name]


def test_the_same_seed_and_voltages_give_the_same_episode(env):
    volts = np.random.default_rng(1).uniform(-8.6, 8.6, (10, 6))
    runs = []
    for _ in range(2):
        first, _ = env.reset(seed=3)
        steps = [env.step(u)[:2] for u in volts]
        runs.append([first.tolist(), *((seen.tolist(), reward) for seen, reward in steps)])
    assert runs[0] == runs[1]


def test_the_stance_foot_is_forgotten_between_episodes():
    env = ModelEnv(Model('leo_ode', engine='mujoco'))
    firsts = []
    for push in (np.full(6, 8.0), np.full(6, -8.0)):
        env.reset(options={'pose': 'nominal'})
        firsts.append(env.step(np.zeros(6))[1])
        for _ in range(20):
            env.step(push)
    assert firsts[0] == firsts[1]
