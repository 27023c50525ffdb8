# SPDX-License-Identifier: Apache-2.0
"""Scripted motions of a walker."""

from dataclasses import replace

import numpy as np
import pytest

from leo_msgs_py.errors import UserError
from leo_sim.description.robot import load_robot
from leo_sim.model import Model
from leo_sim.task.motions import check_motion, Falls, LYING_SECONDS, MOTIONS, Routine

LEO = load_robot('leo')


def moved(name: str, seed: int, seconds: float = 3.0) -> tuple[np.ndarray, np.ndarray]:
    rng, model = np.random.default_rng(seed), Model(LEO, engine='rigid', scheme='search')
    state, script = model.start(MOTIONS[name].start, rng), MOTIONS[name].script(LEO, rng)
    falls, rows = Falls(LEO), []
    for k in range(round(seconds / LEO.control_period)):
        if falls.over(state.q):
            break
        volts = script(k * LEO.control_period, state.q, state.dq)
        rows.append((state.q, volts))
        state = model.step(state, volts, LEO.control_period)
    q, volts = zip(*rows, strict=True)
    return np.array(q), np.array(volts)


@pytest.mark.parametrize('name', MOTIONS)
def test_every_joint_moves_and_voltages_stay_in_their_limits(name):
    q, volts = moved(name, seed=2)
    assert np.all(np.ptp(q[:, 3:], axis=0) > 0.01)
    assert np.all(np.abs(volts) <= LEO.limits) and np.all(np.ptp(volts, axis=0) > 0.1)


def test_standing_stands():
    q, _ = moved('standing', seed=4)
    assert len(q) == 100 and np.abs(q[:, 2]).max() < 0.3


@pytest.mark.parametrize('name', MOTIONS)
def test_the_same_numbers_make_the_same_motion_and_others_another(name):
    one, same, other = (moved(name, seed, 0.6)[1] for seed in (1, 1, 2))
    assert np.array_equal(one, same) and not np.array_equal(one, other)


def test_a_fall_is_over_when_it_has_lain_for_a_while():
    falls, q = Falls(LEO), Model(LEO, engine='rigid').start('standing').q.copy()
    assert not any(falls.over(q) for _ in range(100))
    q[2] = 1.4
    count = next(k for k in range(100) if falls.over(q))
    assert count * LEO.control_period == pytest.approx(LYING_SECONDS, abs=LEO.control_period)


@pytest.mark.parametrize('name', ['leo', 'leo_ode'])
def test_the_walkers_that_are_shipped_can_do_the_motions(name):
    for motion in MOTIONS:
        check_motion(load_robot(name), motion)


@pytest.mark.parametrize('motion', sorted(MOTIONS))
def test_a_walker_without_a_pose_is_told_which(motion):
    pose = MOTIONS[motion].start
    poses = {name: it for name, it in LEO.start_poses.items() if name != pose}
    with pytest.raises(UserError, match=f'robot.yaml: start_poses: the pose {pose} is missing'):
        check_motion(replace(LEO, start_poses=poses), motion)


def test_a_walker_with_other_motors_or_no_feet_is_told_what_it_needs():
    with pytest.raises(UserError, match=r'actuators.*left_hip, right_hip.*and no others'):
        check_motion(replace(LEO, actuators=LEO.actuators[:5]), 'stepping')
    with pytest.raises(UserError, match='base: planar, and feet'):
        check_motion(replace(LEO, feet=()), 'stepping')


def test_after_a_fall_a_routine_begins_anew_in_another_way():
    routine, q = Routine(LEO, 'stepping', 3), Model(LEO, engine='rigid').start('standing').q.copy()
    first, lying = routine.volts(q, 0.0 * q), q.copy()
    lying[2] = 1.4
    while routine.volts(lying, 0.0 * q) is not None:
        pass
    again = routine.volts(q, 0.0 * q)
    assert again is not None and not np.allclose(first, again)


def test_a_hanging_robot_does_not_fall():
    routine, q = Routine(LEO, 'swinging', 3), np.zeros(9)
    q[2] = 1.4
    assert all(routine.volts(q, np.zeros(9)) is not None for _ in range(50))
