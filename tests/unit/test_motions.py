# SPDX-License-Identifier: Apache-2.0
"""Scripted motions of a walker."""

from dataclasses import replace

import numpy as np
import pytest

from leo_msgs_py.errors import UserError
from leo_sim.model import Model
from leo_sim.motions import check_walker, Falls, LYING_SECONDS, MOTIONS
from leo_sim.robot import load_robot

LEO = load_robot('leo')


def moved(name: str, seed: int, seconds: float = 3.0) -> tuple[np.ndarray, np.ndarray]:
    """Angles and voltages of a motion from its start pose, until it falls."""
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
    check_walker(load_robot(name))


@pytest.mark.parametrize('pose', sorted({motion.start for motion in MOTIONS.values()}))
def test_a_walker_without_a_pose_is_told_which(pose):
    poses = {name: it for name, it in LEO.start_poses.items() if name != pose}
    with pytest.raises(UserError, match=f'robot.yaml: start_poses: the pose {pose} is missing'):
        check_walker(replace(LEO, start_poses=poses))


def test_a_walker_with_other_motors_or_no_feet_is_told_what_it_needs():
    with pytest.raises(UserError, match=r'actuators.*left_hip, right_hip.*and no others'):
        check_walker(replace(LEO, actuators=LEO.actuators[:5]))
    with pytest.raises(UserError, match='base: planar, and feet'):
        check_walker(replace(LEO, feet=()))
