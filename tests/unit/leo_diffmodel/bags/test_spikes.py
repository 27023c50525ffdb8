# SPDX-License-Identifier: Apache-2.0
"""Spikes of a rate that its angle does not support are counted and replaced by its slope."""

from dataclasses import replace

import numpy as np
import pytest

from leo_diffmodel.bags.spikes import without_spikes
from leo_diffmodel.bags.states import StateLog
from leo_diffmodel.bags.topic_map import TopicMap
from leo_sim.description.robot import load_robot

PENDULUM = load_robot('pendulum')
T = 0.01 * np.arange(1000)


def log(q, dq):
    stamps = np.round(T * 1e9).astype(np.int64)
    return StateLog(stamps, stamps, stamps, q[:, None], dq[:, None], None, 0, True)


def filtered(states):
    return without_spikes(states, PENDULUM, TopicMap())


def at_zero(q):
    """The sample behind each whole turn."""
    return 1 + np.flatnonzero(np.diff(np.floor(q / (2 * np.pi))))


@pytest.mark.parametrize('wrapped', [False, True])
@pytest.mark.parametrize('noise', [0.0, 0.02])
def test_spikes_of_an_encoders_zero_are_once_a_turn(wrapped, noise):
    q = 3.0 * T + 0.4 * np.sin(T)
    rate = 3.0 + 0.4 * np.cos(T) + noise * np.random.default_rng(0).normal(size=len(T))
    spiked = rate.copy()
    spiked[at_zero(q)] = 80.0
    states = log(q % (2 * np.pi) if wrapped else q, spiked)
    mended = filtered(states)
    (told,) = mended.notes
    assert '4 spikes in the rate of pivot' in told and 'up to 80 where they change by' in told
    assert 'once a turn at' in told
    np.testing.assert_allclose(mended.dq[:, 0], rate, atol=5 * noise + 0.01)


def test_a_fast_wheel_has_many():
    q, rate = 45.0 * T, np.full_like(T, 45.0)
    rate[at_zero(q)] = -400.0
    mended = filtered(log(q, rate))
    (told,) = mended.notes
    assert f'{len(at_zero(q))} spikes' in told and 'once a turn at' in told
    np.testing.assert_allclose(mended.dq, 45.0)


def test_spikes_anywhere_are_not_once_a_turn():
    q, rate = 3.0 * T, np.full_like(T, 3.0)
    rate[[100, 333, 480]] = (60.0, -45.0, 50.0)
    mended = filtered(log(q, rate))
    (told,) = mended.notes
    assert '3 spikes' in told and 'turn at' not in told
    np.testing.assert_allclose(mended.dq, 3.0)


def test_a_joint_that_swings_over_its_zero_has_them_at_one_angle():
    q, rate = np.sin(2 * T) + 6.0, 2 * np.cos(2 * T)
    rate[at_zero(q)] = 90.0
    (told,) = filtered(log(q, rate)).notes
    assert f'{len(at_zero(q))} spikes' in told and ('all at' in told or 'once a turn at' in told)


@pytest.mark.parametrize('case', ['impact', 'noise', 'coarse', 'late', 'unit'])
def test_what_the_angle_supports_or_noise_makes_is_no_spike(case):
    rng = np.random.default_rng(1)
    q, rate = np.sin(3 * T), 3 * np.cos(3 * T)
    if case == 'impact':  # bounces back from a stop
        q, rate = np.abs(np.sin(3 * T)), 3 * np.cos(3 * T) * np.sign(np.sin(3 * T) + 1e-12)
    if case == 'noise':
        rate = rate + 0.3 * rng.standard_t(5, size=len(T))
    if case == 'coarse':
        rate = np.round(rate / 0.8) * 0.8
    if case == 'late':
        rate = np.roll(rate, 18)
    if case == 'unit':
        rate = rate * 9.55
    states = log(q, rate)
    mended = filtered(states)
    assert mended.notes == () and np.array_equal(mended.dq, states.dq)


def test_a_rate_that_nobody_measured_has_none():
    states = log(np.sin(T), np.full_like(T, np.nan))
    assert filtered(states).notes == ()
    assert filtered(replace(states, dq=None)).notes == ()
