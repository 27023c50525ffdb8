# SPDX-License-Identifier: Apache-2.0
"""Start states projected out of a window's residual."""

import numpy as np
import pytest

from leo_diffmodel.explain.problem.shooting import eliminate, Linear


def _linear(rng: np.random.Generator) -> Linear:
    return Linear(*(rng.standard_normal(shape) for shape in ((2, 12), (2, 12, 4), (2, 12, 3))))


def test_the_step_of_the_starts_is_that_of_least_squares():
    linear = _linear(np.random.default_rng(0))
    rest, by_theta, start, gain = eliminate(linear)
    for w in range(2):
        expected = np.linalg.lstsq(linear.by_start[w], linear.residual[w], rcond=None)[0]
        assert start[w] == pytest.approx(expected)
        assert linear.by_start[w].T @ rest[w] == pytest.approx(np.zeros(4), abs=1e-12)
        assert linear.by_start[w].T @ by_theta[w] == pytest.approx(np.zeros((4, 3)), abs=1e-12)
    assert gain.shape == (2, 4, 3)


def test_a_start_that_does_not_show_stays_where_it_is():
    linear = _linear(np.random.default_rng(1))
    linear.by_start[1, :, 2] = 0.0
    rest, _, start, gain = eliminate(linear)
    assert start[1, 2] == 0.0 and not gain[1, 2].any()
    assert np.isfinite(start).all() and (rest[1] ** 2).sum() <= (linear.residual[1] ** 2).sum()
