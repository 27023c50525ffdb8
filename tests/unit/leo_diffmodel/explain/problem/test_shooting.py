# SPDX-License-Identifier: Apache-2.0
"""Start states projected out of a window's residual; steps of derivatives."""

import numpy as np
import pytest
from tests.simulate import POSITION

from leo_diffmodel.compare.windows import Windows
from leo_diffmodel.explain.problem.candidates import candidates
from leo_diffmodel.explain.problem.hypothesis import Hypothesis
from leo_diffmodel.explain.problem.shooting import difference_steps, eliminate, Linear, whiten
from leo_diffmodel.explain.settings import SETTINGS
from leo_sim.model import Model


def _linear(seed: int) -> Linear:
    rng = np.random.default_rng(seed)
    return Linear(*(rng.standard_normal(shape) for shape in ((2, 12), (2, 12, 4), (2, 12, 3))))


def test_the_step_of_the_starts_is_that_of_least_squares():
    linear = _linear(0)
    rest, by_theta, start, gain = eliminate(linear)
    for w in range(2):
        expected = np.linalg.lstsq(linear.by_start[w], linear.residual[w], rcond=None)[0]
        assert start[w] == pytest.approx(expected)
        assert linear.by_start[w].T @ rest[w] == pytest.approx(np.zeros(4), abs=1e-12)
        assert linear.by_start[w].T @ by_theta[w] == pytest.approx(np.zeros((4, 3)), abs=1e-12)
    assert gain.shape == (2, 4, 3)


def test_a_start_that_does_not_show_stays_where_it_is():
    linear = _linear(1)
    linear.by_start[1, :, 2] = 0.0
    rest, _, start, gain = eliminate(linear)
    assert start[1, 2] == 0.0 and not gain[1, 2].any()
    assert np.isfinite(start).all() and (rest[1] ** 2).sum() <= (linear.residual[1] ** 2).sum()


@pytest.mark.filterwarnings('error')
def test_a_robot_sent_to_infinity_is_far_off_without_a_word():
    still = np.zeros((1, 2, 1))
    none = np.zeros((1, 1, 0))
    windows = Windows(still, still, none, none, np.ones((1, 1)), *np.zeros((3, 1), dtype=int))
    predicted = np.array([[[0.0, 0.0], [1e308, np.inf]]])
    scaled = whiten(windows, predicted, np.full((1, 2), 1e-5), farthest=1e6)
    assert scaled.tolist() == [[0.0, 0.0, -1e6, -1e6]]


def test_a_limit_that_is_as_good_as_none_when_neutral_is_moved_by_a_share_of_itself():
    found = next(c for c in candidates(Model(POSITION)) if c.effect.name == 'goal_acceleration')
    (step,) = difference_steps(Hypothesis((found,)), np.array([60.0]), None, SETTINGS.numerics)
    assert found.parameters[0].neutral > 1e6 and step == pytest.approx(0.3)
