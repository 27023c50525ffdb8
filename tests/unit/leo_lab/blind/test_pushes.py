# SPDX-License-Identifier: Apache-2.0
"""Robots that somebody moves: shoves, a leading hand, a joint held still."""

import numpy as np
import pytest

from leo_diffmodel.bags.recording import read_bag
from leo_diffmodel.compare.sizes import torque_scale
from leo_lab.blind.case import draw_case
from leo_lab.blind.pushes import draw_pushes, inertia, Push, Pusher, SHOVE_SIZE
from leo_lab.blind.record import record
from leo_sim.description.robot import load_robot
from leo_sim.model import Model

LED, HELD = 8, 16  # seeds of the pendulum that are led and held, without anything hidden


@pytest.mark.parametrize('robot', ['pendulum', 'double_pendulum'])
def test_shoves_are_short_strong_and_few(robot):
    robot, rng = load_robot(robot), np.random.default_rng(1)
    drawn = [draw_pushes('shoves', robot, 20.0, rng) for _ in range(60)]
    assert {len(pushes) for pushes in drawn} == {1, 2, 3, 4, 5}
    for push in (p for pushes in drawn for p in pushes):
        assert 0.1 <= push.seconds <= 0.3 and push.begin + push.seconds < 20.0
        assert abs(push.torque) <= SHOVE_SIZE[1] * torque_scale(robot)


def test_a_shove_is_half_a_sine():
    model = Model('torque_pendulum')
    pusher, at = Pusher(model, [Push('pivot', 1.0, 0.2, 0.5)]), np.zeros(1)
    torques = [pusher.torque(t, at, at)[0] for t in (0.99, 1.0, 1.1, 1.19999, 1.21)]
    assert torques == pytest.approx([0, 0, 0.5, 0, 0], abs=1e-3)
    assert pusher.acts(0.9, 1.05) and not pusher.acts(1.2, 1.3) and inertia(model)[0] > 0


def test_a_hand_leads_for_most_of_the_time_and_the_motors_rest(tmp_path):
    case = draw_case(LED, 'pushed')
    (scene,), pushes = case.run.scenes, case.pushes
    assert sum(p.seconds for p in pushes) > 0.5 * 20.0 and case.effects == ()
    time = case.robot.control_period * np.arange(scene.count)
    led = np.any([(time >= p.begin) & (time < p.begin + p.seconds) for p in pushes], axis=0)
    assert np.all(scene.inputs[led] == 0.0)
    (bag,) = record(case, tmp_path)
    (episode,) = read_bag(bag, case.robot).episodes
    moved = episode.q[(episode.t > pushes[0].begin) & (episode.t < pushes[0].begin + 5)]
    assert np.ptp(moved) > 0.3 and np.all(np.abs(np.diff(moved[50:, 0])) < 0.15)


def test_a_joint_that_is_held_stays_where_it_was(tmp_path):
    case = draw_case(HELD, 'pushed')
    (push,) = case.pushes
    (bag,) = record(case, tmp_path)
    (episode,) = read_bag(bag, case.robot).episodes
    during = (episode.t > push.begin + 0.3) & (episode.t < push.begin + push.seconds)
    assert np.ptp(episode.q[during]) < 0.1 < np.ptp(episode.q[~during])


def test_pushes_are_drawn_again_from_their_seed_and_a_third_hides_an_effect():
    assert draw_case(LED, 'pushed').pushes == draw_case(LED, 'pushed').pushes
    case = draw_case(50, 'pushed')
    assert case.robot.name == 'torque_pendulum' and len(case.effects) == 1
    assert case.sizes[0] > 4.0 and not case.small
