# SPDX-License-Identifier: Apache-2.0
"""Intervals of parameters hold where what is left is no white noise."""

import numpy as np
import pytest

from leo_diffmodel.explain.estimate.covariance import beyond, covariance
from leo_diffmodel.explain.problem import likelihood
from leo_diffmodel.explain.settings import SETTINGS

RUNS, BLOCKS, PER_BLOCK, SAMPLES, CHANNELS = 150, 12, 4, 15, 2


def variance(columns, residual, block, prior, spread=1.0) -> np.ndarray:
    return covariance(columns, residual, block, prior, spread, CHANNELS, SETTINGS.numerics)


def follow(rng: np.random.Generator, by: float, count: int, channels: int) -> np.ndarray:
    """Noise of unit variance in which neighbours in time are alike, shape (count, channels)."""
    e = rng.standard_normal((count, channels))
    for k in range(1, count):
        e[k] = by * e[k - 1] + np.sqrt(1 - by**2) * e[k]
    return e


def interval(seed: int, by: float, size: float) -> tuple[np.ndarray, np.ndarray]:
    """Error and 95 % half width of two parameters of a regression."""
    rng = np.random.default_rng(seed)
    windows, count = BLOCKS * PER_BLOCK, BLOCKS * PER_BLOCK * SAMPLES
    shape = windows, SAMPLES * CHANNELS
    columns = np.stack([follow(rng, 0.8, count, CHANNELS).reshape(shape) for _ in range(2)], -1)
    noise = size * follow(rng, by, count, CHANNELS).reshape(shape)
    flat = columns.reshape(-1, 2)
    wrong = np.linalg.lstsq(flat, noise.ravel(), rcond=None)[0]
    residual = noise - columns @ wrong
    block = np.repeat(np.arange(BLOCKS), PER_BLOCK)
    spread = likelihood.dispersion(residual, CHANNELS)
    found = variance(-columns, residual, block, np.zeros(2), spread)
    return wrong, 1.96 * np.sqrt(np.diagonal(found))


@pytest.mark.parametrize(
    ('by', 'size'),
    [(0.0, 1.0), (0.6, 1.0), (0.8, 3.0)],
    ids=['white', 'correlated', 'wrong model'],
)
def test_19_of_20_intervals_hold_the_truth(by, size):
    runs = [interval(seed, by, size) for seed in range(RUNS)]
    inside = [abs(wrong) < half for wrong, half in runs]
    assert 0.90 <= np.mean(inside) <= 0.98


def test_a_parameter_held_fast_has_no_variance_and_one_that_does_not_show_a_huge_one():
    rng = np.random.default_rng(0)
    columns, residual = rng.standard_normal((48, 30, 3)), rng.standard_normal((48, 30))
    columns[..., 2] = 0.0
    found = variance(columns, residual, np.arange(48), np.array([0.0, np.inf, 0.0]))
    assert found[1, 1] == 0.0 and found[2, 2] > 1e6
    assert found[0, 0] == pytest.approx(1 / 1440, rel=0.5)


@pytest.mark.parametrize(('spread', 'blocks'), [(1.0, 48), (4.0, 48), (1.0, 3)])
def test_what_two_parameters_do_alike_is_told_apart_by_what_is_known_of_one(spread, blocks):
    rng = np.random.default_rng(0)
    columns, residual = rng.standard_normal((48, 30, 1)), rng.standard_normal((48, 30))
    same, prior = np.repeat(columns, 2, axis=-1), np.array([0.0, 1 / 0.3**2])
    found = variance(same, residual, np.arange(48) * blocks // 48, prior, spread)
    np.testing.assert_allclose(np.sqrt(np.diagonal(found)), 0.3, rtol=0.05)
    assert found[0, 1] == pytest.approx(-found[1, 1], rel=0.05)


def test_few_blocks_make_wider_intervals():
    rng = np.random.default_rng(0)
    columns, residual = rng.standard_normal((48, 30, 1)), rng.standard_normal((48, 30))
    draws = [rng.permutation(residual.ravel()).reshape(48, 30) for _ in range(40)]
    folds = [np.arange(48) * blocks // 48 for blocks in (48, 3)]
    many, few = (np.mean([variance(columns, e, f, np.zeros(1)) for e in draws]) for f in folds)
    assert np.sqrt(few) > 1.5 * np.sqrt(many)


@pytest.mark.parametrize(
    ('bend', 'rise', 'far'),
    [(100.0, 0.0, 0.196), (0.0, 0.0, 0.5), (0.0, 19.2, 0.1), (100.0, 1e6, 0.0)],
    ids=['as far as noise allows', 'to the other bound', 'against a slope', 'held firmly'],
)
def test_what_makes_up_for_a_constant_may_move_as_that_moves_off_its_bound(bend, rise, far):
    """Two parameters of the unit curvature `bend` beside their sum, which the data know."""
    sure = 1e6
    matrix = sure * np.ones((2, 2)) + np.diag([0.0, bend])
    descent, prior = np.array([0.0, rise]), np.array([0.0, np.inf])
    room = np.array([0.0, -0.5])
    moved = beyond(matrix, descent, prior, room, 1.0, SETTINGS.numerics)
    np.testing.assert_allclose(moved, [[0.0, far], [far, 0.0]], atol=2e-3)
    none = beyond(matrix, descent, prior, 0.0 * room, 1.0, SETTINGS.numerics)
    assert not none.any()
