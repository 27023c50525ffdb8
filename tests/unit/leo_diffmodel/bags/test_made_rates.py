# SPDX-License-Identifier: Apache-2.0
"""Velocities that are differences of the positions are told from measured ones."""

import numpy as np
import pytest

from leo_diffmodel.bags.arrays import Run, write_runs
from leo_diffmodel.bags.recording import read_bag
from leo_diffmodel.bags.unmeasured import made_from
from leo_sim.description.robot import load_robot

PENDULUM = load_robot('pendulum')
TICK = 2 * np.pi / 4096


def swing(period: float, count: int = 400) -> tuple[np.ndarray, ...]:
    """Times (T,) with jitter, angles in steps of an encoder (T, 1), true rates (T, 1)."""
    rng = np.random.default_rng(0)
    t = period * (np.arange(count) + rng.uniform(-0.1, 0.1, count))
    q = np.sin(3 * t) + 0.2 * np.sin(11 * t)
    dq = 3 * np.cos(3 * t) + 2.2 * np.cos(11 * t)
    return t, TICK * np.round(q / TICK)[:, None], dq[:, None]


def differences(t: np.ndarray, q: np.ndarray, way: str) -> np.ndarray:
    step = np.diff(q, axis=0) / np.diff(t)[:, None]
    if way == 'central':
        return np.gradient(q, t, axis=0)
    return np.vstack([step[:1], step] if way == 'backward' else [step, step[-1:]])


def nanoseconds(t: np.ndarray) -> np.ndarray:
    return np.round((t - t[0]) * 1e9).astype(np.int64)


@pytest.mark.parametrize('period', [1 / 30, 0.01, 0.001])
@pytest.mark.parametrize('way', ['backward', 'forward', 'central'])
def test_differences_are_recognised_however_they_were_written(period, way):
    t, q, _ = swing(period)
    for dq in (differences(t, q, way), differences(t, q, way).round(4)):
        assert made_from(nanoseconds(t), q, dq) == way


@pytest.mark.parametrize('noise', [0.0, 1e-3, 0.05])
@pytest.mark.parametrize('period', [1 / 30, 0.01, 0.001])
def test_measured_rates_are_not_taken_for_differences(period, noise):
    t, q, dq = swing(period)
    rng = np.random.default_rng(1)
    assert made_from(nanoseconds(t), q, dq + rng.normal(0, noise, dq.shape)) == ''
    smooth = np.sin(3 * t)[:, None]
    assert made_from(nanoseconds(t), smooth, 3 * np.cos(3 * t)[:, None]) == ''


def test_a_joint_that_stands_or_a_few_samples_say_nothing():
    t, q, dq = swing(0.01)
    still = np.zeros_like(q)
    made = differences(t, q, 'backward')
    assert made_from(nanoseconds(t), still, still) == ''
    assert made_from(nanoseconds(t), np.hstack([q, still]), np.hstack([made, still])) == 'backward'
    assert made_from(nanoseconds(t), np.hstack([q, q]), np.hstack([made, dq])) == ''
    assert made_from(nanoseconds(t)[:9], q[:9], made[:9]) == ''
    assert made_from(np.zeros(400, np.int64), q, made) == ''


def test_a_bag_of_them_is_read_as_one_without_rates(tmp_path):
    t, q, dq = swing(0.01)
    runs = {'measured': dq, 'made': differences(t, q, 'backward'), 'absent': None}
    read = {}
    for name, rates in runs.items():
        run = Run(t, ['pivot'], q, rates)
        read[name] = read_bag(write_runs(tmp_path / name, [run], {}), PENDULUM)
        assert read[name].rates == name
    assert 'the velocities are backward differences' in ' '.join(read['made'].warnings)
    np.testing.assert_array_equal(read['made'].episodes[0].dq, read['absent'].episodes[0].dq)
