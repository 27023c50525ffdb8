# SPDX-License-Identifier: Apache-2.0
"""The loss of a window, whose channels each have a size of what the model is off by."""

import numpy as np
import pytest

from leo_diffmodel.explain.problem import likelihood as nats
from leo_diffmodel.explain.settings import SETTINGS

CHANNELS, SAMPLES, WINDOWS = 2, 60, 400
NUMERICS = SETTINGS.numerics


def noise(times: float, seed: int = 0) -> np.ndarray:
    shape = WINDOWS, SAMPLES * CHANNELS
    return times * np.random.default_rng(seed).standard_normal(shape)


def test_noise_costs_half_its_sum_of_squares():
    residual = noise(1.0)
    half = 0.5 * (residual**2).sum(axis=1)
    assert nats.loss(residual, CHANNELS, NUMERICS).mean() == pytest.approx(half.mean(), rel=0.03)
    assert nats.unexplained(residual, CHANNELS, NUMERICS).mean() < 0.5


def test_windows_at_rest_leave_nothing_and_do_not_hide_what_others_leave():
    """The start state of a joint that sticks takes all of a constant reading."""
    residual = noise(2.0)
    residual[: WINDOWS // 4] = 0.0
    most = np.sort((noise(2.0)[WINDOWS // 4 :] ** 2).mean(axis=1))
    assert nats.excess(residual, CHANNELS) == pytest.approx(most[WINDOWS // 4], rel=0.1)
    assert nats.excess(0.0 * residual, CHANNELS) == 0.0


def test_ten_times_as_much_costs_the_logarithm_of_ten_more():
    far, farther = (nats.loss(noise(t), CHANNELS, NUMERICS) for t in (30.0, 300.0))
    assert farther - far == pytest.approx(SAMPLES * CHANNELS * np.log(10.0), rel=0.01)
    left = nats.unexplained(noise(30.0), CHANNELS, NUMERICS).mean()
    assert left == pytest.approx(SAMPLES * CHANNELS * np.log(30.0), rel=0.02)


@pytest.mark.parametrize('typical', [None, np.array([[3.0, 1.0]])])
@pytest.mark.parametrize('times', [0.5, 1.0, 1.5, 4.0, 40.0])
def test_the_weighed_residual_is_the_slope(times, typical):
    residual, step = noise(times)[:3, :40], 1e-6
    moved = residual[:, None] + step * np.array([1.0, -1.0])[:, None, None, None] * np.eye(40)
    up, down = nats.loss(moved, CHANNELS, NUMERICS, typical)
    slope = (up - down) / (2 * step)
    weighed = nats.robust_weight(residual, CHANNELS, NUMERICS, typical) * residual
    assert weighed == pytest.approx(slope, abs=1e-3)


def test_the_typical_size_is_the_most_likely_one():
    residual = np.concatenate([noise(2.0), noise(20.0, 1)])
    found = nats.typical_size(residual, CHANNELS, NUMERICS)
    assert found == pytest.approx(np.full((1, CHANNELS), np.sqrt(2.0 * 20.0)), rel=0.05)
    scales = found * np.array([0.8, 1.0, 1.25])[:, None, None]
    low, least, high = (nats.loss(residual, CHANNELS, NUMERICS, scale).sum() for scale in scales)
    assert least < min(low, high)
    assert nats.typical_size(noise(0.9), CHANNELS, NUMERICS) == pytest.approx(1.0, abs=0.01)


def test_a_quiet_window_says_no_more_than_a_typical_one_allows():
    quiet, typical = noise(1.0), np.full((1, CHANNELS), 10.0)
    assert nats.robust_weight(quiet, CHANNELS, NUMERICS).mean() > 0.9
    shared = nats.robust_weight(quiet, CHANNELS, NUMERICS, typical)
    assert shared.mean() == pytest.approx(2.0 / 101.0, rel=0.05)


def test_one_channel_off_by_much_takes_no_say_from_the_other():
    residual = noise(1.0).reshape(WINDOWS, SAMPLES, CHANNELS)
    residual[..., 1] *= 50.0
    weight = nats.robust_weight(residual.reshape(WINDOWS, -1), CHANNELS, NUMERICS)
    weight = weight.reshape(residual.shape)
    assert weight[..., 0].mean() > 0.9 and weight[..., 1].mean() < 1e-3


def test_a_change_costs_what_was_promised():
    change, residual = 3.0 * noise(1.0, 1), 2.0 * noise(1.0)
    after, before = (nats.loss(e, CHANNELS, NUMERICS) for e in (residual + change, residual))
    cost = (after - before).mean()
    found = nats.promised(change, residual, CHANNELS, NUMERICS).mean()
    assert found == pytest.approx(cost, rel=0.1)


def test_a_share_more_costs_nothing_where_only_noise_is_left():
    assert nats.swollen(noise(1.0), CHANNELS, NUMERICS, 0.2).mean() < 1.0
    after, before = (nats.loss(noise(30.0) * t, CHANNELS, NUMERICS) for t in (np.sqrt(1.2), 1.0))
    more = after - before
    assert nats.swollen(noise(30.0), CHANNELS, NUMERICS, 0.2) == pytest.approx(more, rel=0.02)
