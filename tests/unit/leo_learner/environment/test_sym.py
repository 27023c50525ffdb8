# SPDX-License-Identifier: Apache-2.0
"""Sym: stance and swing instead of left and right, three voltages, P controllers for the rest."""

from dataclasses import replace

from gymnasium.utils.env_checker import check_env
import numpy as np
import pytest

from leo_learner.ddpg.agent import Training
from leo_learner.ddpg.configs import RECOMMENDED
from leo_learner.environment.env import ModelEnv
from leo_learner.environment.sym import OBSERVED, Sym, SymMap
from leo_learner.learning.policy import Policy, save_policy
from leo_learner.training.loop import play
from leo_msgs_py.errors import UserError
from leo_sim.description.robot import load_robot
from leo_sim.model import Model

ODE = load_robot('leo_ode')
LEFT_RIGHT = [0, 1, 2, 4, 3, 6, 5, 8, 7]  # left and right exchanged in the order of the joints
SMALL = replace(RECOMMENDED, hidden=(8, 8), warm_up=64, test_interval=1, test_starts=1)


@pytest.fixture(scope='module')
def env():
    return Sym(ModelEnv(Model(ODE, scheme='training')))


def state(**angles):
    q = np.zeros(9)
    for joint, angle in angles.items():
        q[ODE.joint_names.index(joint)] = angle
    return q


def test_sees_stance_before_swing():
    legs = {'left_hip': 0.2, 'right_hip': 0.3, 'left_knee': 0.4, 'right_knee': 0.5}
    q = state(torso_pitch=0.1, **legs, left_ankle=9, right_ankle=9)
    seen = SymMap(ODE)
    left, right = (seen.observation(q, 10 * q, stance) for stance in (0, 1))
    assert left.tolist() == [0.2, 0.3, 0.4, 0.5, 0.1, 2, 3, 4, 5, 1]
    assert right.tolist() == [0.3, 0.2, 0.5, 0.4, 0.1, 3, 2, 5, 4, 1]
    joints = 'hip_stance', 'hip_swing', 'knee_stance', 'knee_swing', 'torso'
    assert OBSERVED[:5] == tuple(f'angle({joint})' for joint in joints)


def test_drives_stance_and_swing():
    q = state(left_ankle=0.064926, right_ankle=0.064926)
    volts = SymMap(ODE).volts
    np.testing.assert_allclose(volts([1, 2, 3], q, 0), [1, 2, 0, 3, 0, 0], atol=1e-12)
    np.testing.assert_allclose(volts([1, 2, 3], q, 1), [2, 1, 3, 0, 0, 0], atol=1e-12)
    assert volts([9, -9, 9], q, 0)[[0, 1, 3]].tolist() == [8.6, -8.6, 8.6]


def test_controllers_by_hand():
    volts = SymMap(ODE).volts(np.zeros(3), state(left_knee=-0.1, right_knee=-0.1), 0)
    np.testing.assert_allclose(volts, [0, 0, 1.6970, 0, 1.1018, 1.1018], atol=1e-4)
    volts = SymMap(ODE).volts(np.zeros(3), state(right_knee=-0.1, left_ankle=0.1), 1)
    np.testing.assert_allclose(volts, [0, 0, 0, 1.6970, -0.5952, 1.1018], atol=1e-4)


@pytest.mark.parametrize('limit, expected', [(8.6, 8.6), (12.0, 10.7745)])
def test_controllers_are_clipped_twice(limit, expected):
    paths = [f'actuators.{actuator.joint}.limit' for actuator in ODE.actuators]
    robot = ODE.with_constants({p: replace(ODE.constants[p], value=limit) for p in paths})
    volts = SymMap(robot).volts(np.zeros(3), state(left_knee=-2, left_ankle=2), 0)
    assert volts[[2, 4]].tolist() == [expected, -expected]


@pytest.mark.filterwarnings('ignore::UserWarning')
def test_passes_gymnasiums_checker(env):
    assert env.observation_space.shape == (10,)
    assert env.action_space.high.tolist() == [8.6] * 3
    check_env(env, skip_render_check=True)


def test_left_is_stance_at_the_start(env):
    seen, _ = env.reset(options={'pose': 'nominal'})
    assert env.stance == 0
    np.testing.assert_allclose(seen, [0.1, 0.82, 0, -1.27, -0.1, *[0.0] * 5], atol=1e-12)


def test_the_mirrored_state_moves_mirrored(env):
    action, found = np.array([2.0, -3.0, 4.0]), []
    for order in (list(range(9)), LEFT_RIGHT):
        env.reset(options={'pose': 'nominal'})
        base = env.unwrapped
        base.state = base.model.state_from(base.state.q[order], base.state.dq[order])
        base.sensed = base.state
        env.stance = int(order == LEFT_RIGHT)
        seen = [env.step(action)[0] for _ in range(5)]
        assert env.stance == int(order == LEFT_RIGHT)
        found.append((base.state.q[order], np.array(seen)))
    np.testing.assert_allclose(found[0][0], found[1][0], atol=1e-6)
    np.testing.assert_allclose(found[0][1], found[1][1], atol=1e-4)


def test_a_footstep_exchanges_the_legs(env):
    env.reset(options={'pose': 'nominal'})
    before = env.stance
    for _ in range(40):
        seen, *_ = env.step(np.array([-2.0, -1.0, 6.0]))
        if env.stance != before:
            break
    base = env.unwrapped
    assert (before, env.stance) == (0, 1)
    names = ['right_hip', 'left_hip', 'right_knee', 'left_knee', 'torso_pitch']
    assert seen[:5].tolist() == [base.sensed.q[ODE.joint_names.index(n)] for n in names]


def test_policy_file_says_that_it_is_sym(env, tmp_path):
    training = Training(env, SMALL, seed=1)
    training.run(100)
    path = tmp_path / 'policy.safetensors'
    save_policy(path, training, ODE)
    policy = Policy.load(path)
    assert policy.actions == 'sym' and policy.observation == OBSERVED
    policy.check(ODE)
    own = policy.on(ModelEnv(env.unwrapped.model))
    assert isinstance(own, Sym)
    seen, _ = own.reset(options={'pose': 'nominal'})
    assert policy(seen).shape == (3,)
    assert play(own, policy, 1) == play(env, policy, 1)


def test_policy_files_of_before_are_full(env, tmp_path):
    save_policy(tmp_path / 'policy.safetensors', Training(env.unwrapped, SMALL, seed=1), ODE)
    policy = Policy.load(tmp_path / 'policy.safetensors')
    assert policy.actions == 'full'
    assert policy.on(env.unwrapped) is env.unwrapped
    with pytest.raises(UserError, match="of robot 'leo_ode'"):
        policy.check(load_robot('leo'))
