# SPDX-License-Identifier: Apache-2.0
"""Distance, footsteps, energy and fall of an episode, by hand."""

import json

import numpy as np
import pytest

from leo_diffmodel.bags.recording import read_bag
from leo_learner.environment.env import ModelEnv
from leo_learner.environment.rollouts import Recorded
from leo_learner.environment.walk import footsteps, passes, walked, walks
from leo_learner.verbs.play import main, walk_text
from leo_msgs_py.errors import UserError
from leo_sim.description.robot import load_robot
from leo_sim.kinematics.gait import Gait
from leo_sim.model import Model

LEO, ODE = load_robot('leo'), load_robot('leo_ode')


def leg(robot, lift, swing, **more):
    """One foot 1 mm deep in the ground, the other lifted; the left leg `swing` to the front."""
    q, gait = np.array(Model(robot, engine='rigid').start('standing').q), Gait(robot)
    changes = [
        ('left_hip', swing),
        ('right_hip', -swing),
        ('left_ankle', -swing),
        ('right_ankle', swing),
        (f'{lift}_knee', -0.6),
        (f'{lift}_ankle', 0.6),
    ]
    for joint, value in [*changes, *more.items()]:
        q[robot.joint_names.index(joint)] += value
    q[1] -= gait.clearance(q) + 0.001
    return q


def walk(robot):
    """Left, right, left carries: two footsteps, the second one longer, 2 cm of travel each."""
    rows = [
        leg(robot, 'right', 0.0),
        leg(robot, 'left', -0.1, base_x=0.02),
        leg(robot, 'right', 0.2, base_x=0.04),
    ]
    return np.array(rows)


def test_footsteps_by_hand():
    q, gait = walk(ODE), Gait(ODE)
    first, second = footsteps(gait, q)
    assert first == pytest.approx(float(gait.stride(q[1], 0))) and first > 0
    assert second == pytest.approx(float(gait.stride(q[2], 1))) and second > first
    assert footsteps(gait, q[:1]) == [] == footsteps(gait, q[[0, 0, 0]])


def test_a_step_that_was_lost_is_none_of_the_episode(monkeypatch):
    env = Recorded(ModelEnv(Model(ODE, engine='rigid')))
    env.reset(seed=0)
    lost = np.zeros(1), 0.0, False, True, {'lost': 1}
    monkeypatch.setattr(env.env, 'step', lambda action: lost)
    assert env.step(np.zeros(6))[3] and len(env.com_path()) == 1


def test_passes_by_hand():
    q, gait = walk(ODE), Gait(ODE)
    assert [float(gait.stride(row, 0)) > 0 for row in q] == [False, True, False]
    standing = leg(ODE, 'right', 0.0, right_knee=0.6, right_ankle=-0.6)
    assert abs(float(gait.stride(standing, 0))) < 0.02
    assert passes(gait, q) == 2 and passes(gait, q[[0, 2]]) == 0
    assert passes(gait, np.array([q[1], standing, q[1], standing, q[2]])) == 1


def test_to_and_fro_is_no_distance():
    rocking, gait = [], Gait(ODE)
    for pitch in (0.2, -0.2):
        q = Model(ODE, engine='rigid').start('standing').q + [0, 0, pitch, 0.2, -0.2, 0, 0, 0, 0]
        rocking.append(q - [0, gait.clearance(q) + 0.0001, *[0] * 7])
    lengths = footsteps(gait, np.array(3 * rocking))
    assert len(lengths) >= 4 and min(map(abs, lengths)) > 0.07
    assert sum(lengths[-4:]) == pytest.approx(0, abs=0.002)


@pytest.mark.parametrize('robot', [LEO, ODE], ids=lambda robot: robot.name)
def test_distance_is_as_the_task_pays_it(robot):
    q, volts = walk(robot), np.zeros((2, 6))
    found, gait = walked(robot, q, 0 * q, volts), Gait(robot)
    travel = float(gait.com_x(q[-1]) - gait.com_x(q[0]))
    expected = sum(footsteps(gait, q)) if robot is ODE else travel
    assert found.distance == pytest.approx(expected) and found.footsteps == 2
    assert not found.fell and found.seconds == pytest.approx(0.06)


def test_energy_by_hand():
    q, volts = walk(LEO), np.zeros((2, 6))
    volts[0, 0] = 5.0
    dq = np.zeros((3, 9))
    dq[1, 3] = 2.0
    found = walked(LEO, q, dq, volts)
    energy = 0.03 * 5.0 * (5.0 - 1.344712182 * 1.0) / 4.6
    assert found.energy == pytest.approx(energy)
    assert found.energy_per_metre == pytest.approx(energy / found.distance)


def test_a_fall_and_no_way():
    fallen = leg(LEO, 'right', 0.0, torso_pitch=-1.1)
    found = walked(LEO, np.array([fallen, fallen]), np.zeros((2, 9)), np.zeros((1, 6)))
    assert found.fell and found.distance == 0 and found.energy_per_metre is None
    told = '0.00 m in 0 footsteps (feet passed each other 0 times), 0 J, fell after 0.03 s'
    assert walk_text(found.__dict__) == told


def test_recorded_forgets_the_episode_before():
    env = Recorded(ModelEnv(Model(ODE, scheme='training')))
    for _ in range(2):
        env.reset(options={'pose': 'nominal'})
        first = env.unwrapped.sensed.q
        for _ in range(3):
            env.step(np.full(6, 20.0))
    found = env.walk()
    states = np.array([first, env.unwrapped.sensed.q])
    assert found.seconds == pytest.approx(0.09)
    assert found.energy > 0 and found.footsteps == len(footsteps(Gait(ODE), states))
    assert env.unwrapped.applied.tolist() == [8.6] * 6


def test_only_walkers_walk():
    assert walks(ODE) and walks(LEO) and not walks(load_robot('pendulum'))


def test_the_shipped_policy_walks_and_its_bag_is_read(tmp_path, capsys):
    bag = tmp_path / 'walk'
    assert main(['leo_walk', '--bag', str(bag), '--json']) == 0
    [found] = json.loads(capsys.readouterr().out)['walks']
    assert found['distance'] > 15 and found['footsteps'] > 50 and found['passes'] > 50
    assert not found['fell'] and found['seconds'] == pytest.approx(20.01)
    [episode] = read_bag(bag, LEO).episodes
    assert len(episode.q) == 668
    assert np.ptp(episode.q[:, 0]) == pytest.approx(found['distance'], abs=0.3)
    with pytest.raises(UserError, match='exists; choose another'):
        main(['leo_walk', '--bag', str(bag)])
