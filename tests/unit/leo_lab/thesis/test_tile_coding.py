# SPDX-License-Identifier: Apache-2.0
"""Tile coding: which inputs share tiles, hashing, and weights of their own."""

import numpy as np
import pytest

from leo_lab.thesis.tile_coding import PROBES, tile_keys, TileCoding

WIDTHS = np.array([1.0, 2.0, 4.0])
ACTIONS = np.array([[-1.0], [0.0], [1.0]])


def tiles(memory=2**14, seed=0, initial=0.01):
    return TileCoding(WIDTHS, ACTIONS, 16, memory, initial, seed)


def keys(inputs):
    return tile_keys(np.array(inputs, float), 16 / WIDTHS, 0, 16)


def test_neighbours_share_tiles():
    """Displaced by 1, 3, 5 sub-tiles, every sub-tile in every dimension crosses one border."""
    middle = [0.51, 0.51, 0.51]
    for dimension, width in enumerate(WIDTHS):
        for steps in (0, 1, 5, 15, 16, 40):
            moved = np.array(middle)
            moved[dimension] += steps * width / 16
            shared = int(np.sum(keys(middle) == keys(moved)))
            assert shared == max(0, 16 - steps)


def test_displacements_are_odd_numbers_of_sub_tiles():
    """In tiling j the borders of dimension i lie j (1 + 2 i) sub-tiles further."""
    for dimension, width in enumerate(WIDTHS):
        for tiling in range(16):
            border = tiling * (1 + 2 * dimension) * width / 16
            below, above = np.zeros(3), np.zeros(3)
            below[dimension], above[dimension] = border - 1e-6, border + 1e-6
            assert np.flatnonzero(keys(below) != keys(above)).tolist() == [tiling]


def test_number_of_tiles():
    rows = np.array([keys([x, 0.0, 0.0]) for x in np.arange(0, 10, 0.01)])
    counts = [len(set(column)) for column in rows.T]
    assert counts == [10] + [11] * 15
    assert len({int(key) for key in rows.ravel()}) == sum(counts)


def test_hashing_stays_as_it_is():
    """Policy files hold places in the memory, so these numbers must never change."""
    found = tile_keys(np.array([0.3, -1.2, 7.0]), 16 / WIDTHS, 0, 16)
    assert [int(key) for key in found[:2]] == [13784426123584120596, 12443422180362466869]


def test_weights_start_small_random_and_by_seed():
    grid = np.random.default_rng(0).uniform(-50, 50, (2000, 2))
    made = tiles(), tiles(), tiles(seed=1)
    one, again, other = (np.array([t.values(x) for x in grid]) for t in made)
    assert np.array_equal(one, again) and not np.any(one == other)
    assert one.mean() == pytest.approx(0.005, rel=0.01)
    assert one.std() == pytest.approx(0.01 / np.sqrt(12 * 16), rel=0.05)


def test_value_is_the_mean_of_the_weights():
    coding, seen = tiles(), np.array([0.3, -1.2])
    before = coding.values(seen)
    own = [coding.claim(seen, action) for action in range(3)]
    np.testing.assert_allclose(coding.values(seen), before, rtol=1e-6)
    coding.weights[own[1]] = np.arange(16)
    values = coding.values(seen)
    assert values[1] == 7.5
    for action in range(3):
        assert values[action] == pytest.approx(coding.weights[own[action]].mean(), rel=1e-6)
    assert 0 < len(np.intersect1d(own[0], own[1])) < 16


def test_no_two_tiles_share_a_weight():
    """At three quarters of the memory; unchecked, some 500 of these tiles would share."""
    coding, grid = tiles(memory=2**11), np.arange(96) * 10.0
    slots = np.array([coding.claim(np.array([x, 0.0]), 0) for x in grid])
    assert len(np.unique(slots)) == slots.size == 0.75 * 2**11
    again = np.array([coding.claim(np.array([x, 0.0]), 0) for x in grid])
    assert np.array_equal(slots, again)


def test_a_full_memory_goes_on_with_shared_tiles():
    coding = tiles(memory=64)
    first = coding.claim(np.zeros(2), 0)
    for x in np.arange(1, 20) * 10.0:
        slots = coding.claim(np.array([x, 0.0]), 0)
        assert np.isfinite(coding.values(np.array([x, 0.0]))).all()
    assert PROBES > 64 and 0 <= slots.min() <= slots.max() < 64
    assert np.array_equal(coding.claim(np.zeros(2), 0), first)
    assert len(coding.claimed()['slot']) == 64


def test_restored_tiles_are_the_same():
    coding, grid = tiles(), np.random.default_rng(0).uniform(-5, 5, (200, 2))
    for x in grid:
        coding.weights[coding.claim(x, 1)] += x[0]
    claimed, other = coding.claimed(), tiles()
    other.claim(np.array([77.0, 77.0]), 0)
    other.restore(claimed)
    assert all(np.array_equal(coding.values(x), other.values(x)) for x in grid + 0.3)
    with pytest.raises(ValueError, match='memory of 64'):
        tiles(memory=64).restore(claimed)
