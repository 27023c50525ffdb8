# SPDX-License-Identifier: Apache-2.0
"""What is held out shares no time with what is learned from."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from tests.simulate import record, TORQUE

from leo_diffmodel.compare.blocks import make_blocks
from leo_diffmodel.compare.windows import cut, Windows


def spans(windows: Windows, chosen: np.ndarray) -> list[tuple[float, float]]:
    length = windows.dt.sum(axis=1)
    return list(zip(windows.start[chosen], (windows.start + length)[chosen], strict=True))


@pytest.mark.parametrize('seconds', [3.0, 9.0, 40.0])
@pytest.mark.parametrize('window', [0.08, 0.3, 1.0])
def test_training_and_held_out_windows_share_no_time(seconds, window):
    data = [record(TORQUE, seconds=seconds)]
    windows, blocks = cut(data, window, stride=0.05), make_blocks(data, [])
    train, held = blocks.train(windows), blocks.held(windows)
    assert not (train & held).any()
    for low, high in spans(windows, held):
        assert all(end < low or start > high for start, end in spans(windows, train))


def test_about_a_quarter_is_held_out():
    data = [record(TORQUE, seconds=40)]
    windows, blocks = cut(data, 0.08), make_blocks(data, [])
    assert 0.15 < blocks.held(windows).mean() < 0.3
    assert blocks.train(windows).mean() > 0.65


def test_whole_bags_are_held_out_where_given():
    data = [record(TORQUE, seconds=5, seed=s) for s in (1, 2)]
    windows, blocks = cut(data, 0.3), make_blocks(data[:1], data[1:])
    assert np.array_equal(blocks.held(windows), windows.source == 1)
    assert np.array_equal(blocks.train(windows), windows.source == 0)


def test_blocks_of_two_recordings_are_numbered_apart():
    data = [record(TORQUE, seconds=5, seed=s) for s in (1, 2)]
    windows, blocks = cut(data, 0.3), make_blocks(data, [])
    number = blocks.index(windows)
    assert not set(number[windows.source == 0]) & set(number[windows.source == 1])


def test_windows_never_cross_the_end_of_an_episode():
    whole = record(TORQUE, seconds=5)
    (episode,) = whole.episodes
    windows = cut([whole], 0.5, history=0.15)
    (q, _, inputs, _, gaps) = windows.history
    assert windows.steps == 50 and q.shape[1] == 15
    assert windows.start[0] == pytest.approx(0.15)
    first = round(windows.start[1] / 0.01)
    np.testing.assert_array_equal(windows.q[1], episode.q[first : first + 51])
    np.testing.assert_array_equal(inputs[1], episode.inputs[first - 15 : first])
    np.testing.assert_allclose(gaps, 0.01)
    with pytest.raises(ValueError, match=r'no episode of .+ holds a window of 6 s'):
        cut([whole], 6.0)


@pytest.mark.parametrize('count', [2, 6])
def test_neither_what_is_held_out_nor_the_folds_depend_on_the_order_of_bags(count):
    logs = [record(TORQUE, seconds=7 + s, seed=s) for s in range(count)]
    data = [replace(log, path=Path(f'run{s}')) for s, log in enumerate(logs)]

    def parted(order):
        windows, blocks = cut(order, 0.3), make_blocks(order, [])
        names, held = [order[s].path.name for s in windows.source], blocks.held(windows)
        return {*zip(names, windows.start, held, blocks.folds(windows), strict=True)}

    assert parted(data) == parted(data[::-1])
