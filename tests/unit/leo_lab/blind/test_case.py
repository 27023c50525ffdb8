# SPDX-License-Identifier: Apache-2.0
"""What a blind case hides, by its seed, and what its bags show."""

import numpy as np
import pytest

from leo_diffmodel.bags.recording import read_bag
from leo_lab.blind import outside
from leo_lab.blind.case import draw_case, engine_of, robot_name, ROBOTS
from leo_lab.blind.drawn import LEAST_OF_PAIR, place_of
from leo_lab.blind.open_loop import OpenLoop
from leo_lab.blind.record import record
from leo_lab.blind.truth import hide, reveal
from leo_sim.description.robot import load_robot
from leo_sim.effects import place

PENDULUM, SERVO = 8, 12  # seeds of cases with these robots


def test_half_of_the_cases_of_every_robot_come_from_mujoco_and_half_of_the_rest_from_rk4():
    for robot in ROBOTS:
        seeds = [seed for seed in range(16) if robot_name(seed) == robot]
        engines = [engine_of(seed, walks=False)[0] for seed in seeds]
        assert sorted(engines) == ['mujoco', 'mujoco', 'pybullet', 'rk4']


def test_what_mujoco_has_no_law_for_comes_from_another_integrator():
    gap = place(load_robot('pendulum'), 'backlash', 'pivot', gap=0.02)
    assert engine_of(1, False, (gap,)) == ('rk4', 0.0009)
    assert engine_of(1, True, (gap,))[0] == 'rigid'


def test_strengths_come_in_runs_of_each_length():
    lengths = [draw_case(seed, 'strength').run.seconds for seed in (0, 8, 16, 24)]
    assert lengths == [10.0, 20.0, 40.0, 10.0]


def test_a_servo_is_free_at_times_and_not_quite_what_its_data_sheet_says():
    case = draw_case(SERVO, 'none')
    (scene,) = case.run.scenes
    assert case.run.ever_free and 0.02 < 1 - scene.enabled.mean() < 0.5
    assert np.abs(scene.inputs).max() <= case.robot.actuators[0].limit
    for path, constant in case.robot.constants.items():
        built = case.run.robot.constants[path]
        assert (built == constant) == (constant.uncertain is None)
        if constant.uncertain:
            assert constant.uncertain[0] < built.value < constant.uncertain[1]


def test_a_case_is_drawn_again_from_its_seed():
    one, other = (draw_case(PENDULUM, 'effect') for _ in 'ab')
    assert [place_of(p) for p in one.effects] == [place_of(p) for p in other.effects]
    assert one.effects[0].parameters == other.effects[0].parameters
    assert np.array_equal(one.run.scenes[0].inputs, other.run.scenes[0].inputs)
    assert 1.0 * np.exp(-0.15) < one.sizes[0] < 30.0 * np.exp(0.15)


def test_members_of_a_pair_show_beside_each_other():
    case = draw_case(PENDULUM, 'pair')
    one, other = case.effects
    assert one.effect.name != other.effect.name
    assert min(case.sizes) >= LEAST_OF_PAIR
    beside = OpenLoop(case.run, case.effects, (other,))
    assert case.sizes[0] == pytest.approx(beside.size(one)[0], rel=1e-9)


def test_a_law_outside_the_catalogue_is_hidden_on_every_robot_in_turn():
    assert draw_case(PENDULUM, 'outside').effects[0].effect.name == outside.KINDS[1]


def test_the_bag_shows_free_motors_and_no_truth(tmp_path):
    case = draw_case(SERVO, 'effect')
    (bag,) = record(case, tmp_path)
    (episode,) = read_bag(bag, case.robot).episodes
    on = case.run.scenes[0].enabled.mean()
    assert episode.enabled[:-1].mean() == pytest.approx(on, abs=0.01)
    assert np.all(episode.inputs[episode.enabled < 0.5] == 0)
    name = case.effects[0].effect.name.encode()
    assert not any(name in f.read_bytes() for f in bag.iterdir())


WALKS = 5  # seed of a case of LEO


@pytest.fixture(scope='module')
def walker():
    return draw_case(WALKS, 'effect', 'leo')


def test_a_walker_hangs_stands_and_steps_in_bags_of_their_own(walker, tmp_path):
    bags = [read_bag(bag, walker.robot) for bag in record(walker, tmp_path)]
    assert [bag.held for bag in bags] == [True, False, False]
    seconds = [sum(e.t[-1] - e.t[0] for e in bag.episodes) for bag in bags]
    assert sum(seconds) == pytest.approx(20.0, abs=1.0)
    for bag in bags:
        q = np.concatenate([e.q for e in bag.episodes])
        assert np.all(np.ptp(q[:, 3:], axis=0) > 0.02) and np.isfinite(q).all()
    assert len(bags[2].episodes) > 1  # it fell and was put up again


def test_an_effect_on_a_walker_has_its_size_along_the_run_it_causes(walker):
    (placed,), (size,) = walker.effects, walker.sizes
    assert 1.0 * np.exp(-0.15) < size < 30.0 * np.exp(0.15)
    assert OpenLoop(walker.run, walker.effects).size(placed)[0] == pytest.approx(size, rel=1e-9)
    assert walker.engine[0] == 'mujoco'


def test_the_truth_is_sealed_until_it_is_revealed(tmp_path):
    case = draw_case(SERVO, 'effect')
    hide(case, tmp_path / 'truth')
    assert case.effects[0].effect.name not in (tmp_path / 'truth').read_text()
    truth = reveal(tmp_path / 'truth')
    assert truth['ever_free'] and truth['robot'] == 'servo_pendulum'
    assert len(truth['constants']) == 4
    (effect,) = truth['effects']
    values = {name: float(value) for name, value in case.effects[0].parameters.items()}
    assert effect['parameters'] == pytest.approx(values)
