# SPDX-License-Identifier: Apache-2.0
"""compare.json: how far off a model is, where, and how much of it is noise."""

from dataclasses import replace

import numpy as np
import pytest
from tests.simulate import NOISE, record, TORQUE

from leo_diffmodel.compare import errors
from leo_diffmodel.compare.comparison import compare
from leo_diffmodel.compare.headline import Headline, headline
from leo_sim.description.robot import load_robot
from leo_sim.effects import place
from leo_sim.model import Model

AHEAD = Headline('median', 0.3)


def test_a_right_model_scores_its_noise_floor():
    data = compare([record(TORQUE, seconds=20)], Model(TORQUE)).data
    for row, floor in zip(data['horizon'], data['noise_floor']['horizon'], strict=True):
        near = row['seconds'] <= 0.5  # later a few windows over the top decide
        np.testing.assert_allclose(row['rmse'], floor['rmse'], rtol=0.12 if near else 0.4)
        assert row['mean'] == pytest.approx(np.mean(row['rmse']))
    seen, floor = data['observation']['mse'], data['noise_floor']['observation']['mse']
    assert seen == pytest.approx(floor, rel=0.2)
    one = data['one_step']
    np.testing.assert_allclose(np.square(one['rmse']), one['mse'])
    assert one['mean_mse'] == pytest.approx(np.mean(one['mse']))
    assert data['budget']['unexplained'] < 0.01


def test_a_wrong_model_is_above_it_and_says_where():
    effect = place(TORQUE, 'joint_spring', 'pivot', k=1.0, rest=0.0)
    result = compare([record(TORQUE, effect, seconds=20)], Model(TORQUE)).data
    late, floor = result['horizon'][-1], result['noise_floor']['horizon'][-1]
    assert late['seconds'] == pytest.approx(2.0)
    assert np.all(np.array(late['rmse']) > 5 * np.array(floor['rmse']))
    budget = result['budget']
    assert budget['unexplained'] > 0.02
    assert sum(budget.values()) == pytest.approx(1.0, abs=0.01)
    assert [s['unit'] for s in result['states']] == ['rad', 'rad/s']


def test_the_step_is_the_control_period_unless_given():
    data = [record(TORQUE, seconds=10)]
    assert compare(data, Model(TORQUE)).data['step_seconds'] == 0.01
    given = compare(data, Model(TORQUE), step=0.05).data
    assert given['horizon'][0]['seconds'] == pytest.approx(0.05)


def test_a_few_windows_that_go_astray_do_not_move_the_median():
    windows = errors.horizon_windows([record(TORQUE, seconds=20)], Model(TORQUE), 0.5)
    right = errors.predict_windows(Model(TORQUE), windows, np.array([NOISE]))
    floor = AHEAD.floor(right)['median']
    np.testing.assert_allclose(AHEAD.figures(right)['median'], floor, rtol=0.2)
    astray = right.predicted.copy()
    astray[:: len(astray) // 10] += 3.0
    given = replace(right, predicted=astray)
    np.testing.assert_allclose(AHEAD.figures(given)['median'], floor, rtol=0.3)
    assert np.all(np.array(AHEAD.figures(given)['rmse']) > 10 * np.array(floor))


def test_the_median_of_a_mixture_is_that_of_all_its_errors():
    windows = errors.horizon_windows([record(TORQUE, seconds=20)], Model(TORQUE), 0.5)
    count, size = len(windows.dt), windows.measured.shape
    rng = np.random.default_rng(0)
    for quiet in (0.3, 0.45, 0.6):
        deviation = np.where(np.arange(count) < quiet * count, 0.1, 1.0)[:, None, None]
        error = deviation * rng.standard_normal(size)
        given = errors.Prediction(windows, windows.measured - error, deviation**2 + np.zeros(size))
        ahead = (Headline('median', seconds) for seconds in 0.01 * np.arange(1, 50))
        found = [each.figures(given)['median'] for each in ahead]
        floor = AHEAD.floor(given)['median']
        np.testing.assert_allclose(floor, np.median(found, axis=0), rtol=0.2)


def test_a_robot_on_the_ground_is_given_the_median():
    assert headline(TORQUE) == headline(TORQUE, 0.49) == Headline('rmse', 0.5)
    assert headline(TORQUE, 0.3).words == 'held-out error 0.3 s ahead'
    assert headline(load_robot('leo')).words == 'median held-out error 0.3 s ahead'
