# SPDX-License-Identifier: Apache-2.0
"""Rates and efforts that nobody measured, spikes and wraps are told from what was measured."""

from dataclasses import replace

import numpy as np
import pytest
from tests.messages import bag_of, states

from leo_diffmodel.bags.arrays import Run, write_runs
from leo_diffmodel.bags.recording import read_bag
from leo_diffmodel.bags.spikes import without_spikes
from leo_diffmodel.bags.split import unwrapped
from leo_diffmodel.bags.states import StateLog
from leo_diffmodel.bags.topic_map import TopicMap
from leo_diffmodel.bags.unmeasured import made_from
from leo_msgs_py.errors import UserError
from leo_sim.description.robot import load_robot

PENDULUM, ARM = load_robot('torque_pendulum'), load_robot('double_pendulum')
VOLTS = load_robot('pendulum')
T = 0.01 * np.arange(200)


def bag(folder, joints, q, dq, effort=None):
    columns = [np.column_stack(c) for c in (q, dq, effort) if c]
    return bag_of(folder, *states(len(T), joints, *columns))


def told(recording):
    return [w for w in recording.warnings if 'no measurement' in w]


@pytest.mark.parametrize('value', [-5.4e-310, 3e-320])
def test_memory_that_nobody_wrote_is_no_effort(tmp_path, value):
    log = bag(tmp_path, ['pivot'], [np.sin(T)], [np.cos(T)], [np.where(T < 1.0, value, 0.0)])
    recording = read_bag(log, PENDULUM)
    assert recording.input == 'none' and recording.episodes[0].effort is None
    (text,) = told(recording)
    assert '200 efforts of pivot as ' in text and f'{value:.2g}' in text
    assert any('counts as passive' in w for w in recording.warnings)


def test_a_few_such_values_cost_only_themselves(tmp_path):
    effort = np.where(np.arange(200) % 50 == 7, 1e-310, 0.2)
    recording = read_bag(bag(tmp_path, ['pivot'], [np.sin(T)], [np.cos(T)], [effort]), PENDULUM)
    assert recording.input == 'torque' and '4 efforts of pivot' in told(recording)[0]
    assert np.isnan(recording.episodes[0].effort).sum() == 4
    assert set(recording.episodes[0].inputs[:, 0]) == {0.2}


def test_a_rate_of_one_joint_that_never_changes_while_it_moves_is_differentiated(tmp_path):
    q = [np.sin(T), 0.3 + np.sin(2 * T)]
    log = bag(tmp_path, ARM.joint_names, q, [np.cos(T) + 0.01, 0 * T])
    recording = read_bag(log, ARM)
    (episode,) = recording.episodes
    (text,) = told(recording)
    assert 'rates of elbow are 0 throughout while it moves by 1.7 rad: no measurement;' in text
    assert np.array_equal(episode.dq[:, 0], np.cos(T) + 0.01) and recording.rates == 'measured'
    np.testing.assert_allclose(episode.dq[1:-1, 1], 2 * np.cos(2 * T)[1:-1], atol=1e-3)
    (slow,) = read_bag(log, ARM, TopicMap(time_scale=2.0)).episodes
    np.testing.assert_allclose(slow.dq, episode.dq * [1.0, 0.5])


@pytest.mark.parametrize(
    'q',
    [
        np.round(0.2 + 0.0002 * (np.arange(200) % 2), 4),  # an encoder's flicker
        (3.0 * T + np.pi) % (2 * np.pi) - np.pi,
    ],
)
def test_a_constant_rate_that_is_right_stays(tmp_path, q):
    rate = np.full_like(T, 3.0 if np.ptp(q) > 1 else 0.0)
    log = bag(tmp_path, ARM.joint_names, [np.sin(T), q], [np.cos(T) + 0.01, rate])
    recording = read_bag(log, ARM)
    assert told(recording) == [] and set(recording.episodes[0].dq[:, 1]) == {rate[0]}


def test_an_effort_of_0_while_the_joint_moves_is_no_input(tmp_path):
    log = bag(tmp_path, ['pivot'], [np.sin(T)], [np.cos(T)], [0 * T])
    recording = read_bag(log, PENDULUM)
    assert recording.input == 'none'
    assert 'efforts of pivot are 0 while it moves' in told(recording)[0]
    kept = read_bag(log, PENDULUM, TopicMap(input='effort'))
    assert kept.input == 'torque' and told(kept) == []


def test_one_motor_without_effort_among_others_is_asked_about(tmp_path):
    q, dq = [np.sin(T), np.sin(T)], [np.cos(T), np.cos(T)]
    log = bag(tmp_path, ARM.joint_names, q, dq, [0.1 * np.cos(T), 0 * T])
    with pytest.raises(UserError, match='efforts of some motors and none of elbow'):
        read_bag(log, ARM)
    assert read_bag(log, ARM, TopicMap(input='effort')).input == 'torque'


def test_a_joint_that_stands_is_measured(tmp_path):
    recording = read_bag(bag(tmp_path, ['pivot'], [0 * T], [0 * T], [0 * T]), PENDULUM)
    assert recording.input == 'torque' and told(recording) == []


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
    assert made_from(nanoseconds(t), np.sin(3 * t)[:, None], 3 * np.cos(3 * t)[:, None]) == ''


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
        read[name] = read_bag(write_runs(tmp_path / name, [run], {}), VOLTS)
        assert read[name].rates == name
    assert 'the velocities are backward differences' in ' '.join(read['made'].warnings)
    np.testing.assert_array_equal(read['made'].episodes[0].dq, read['absent'].episodes[0].dq)


TEN = 0.01 * np.arange(1000)


def log(q, dq):
    stamps = np.round(0.01e9 * np.arange(len(q))).astype(np.int64)
    return StateLog(stamps, stamps, stamps, q[:, None], dq[:, None], None, 0, True)


def filtered(states):
    return without_spikes(states, VOLTS, TopicMap())


def at_zero(q):
    """The sample behind each whole turn."""
    return 1 + np.flatnonzero(np.diff(np.floor(q / (2 * np.pi))))


@pytest.mark.parametrize('wrapped', [False, True])
@pytest.mark.parametrize('noise', [0.0, 0.02])
def test_spikes_of_an_encoders_zero_are_once_a_turn(wrapped, noise):
    q = 3.0 * TEN + 0.4 * np.sin(TEN)
    rate = 3.0 + 0.4 * np.cos(TEN) + noise * np.random.default_rng(0).normal(size=len(TEN))
    spiked = rate.copy()
    spiked[at_zero(q)] = 80.0
    mended = filtered(log(q % (2 * np.pi) if wrapped else q, spiked))
    (told,) = mended.notes
    assert '4 spikes in the rate of pivot' in told and 'up to 80 where they change by' in told
    assert 'once a turn at' in told
    np.testing.assert_allclose(mended.dq[:, 0], rate, atol=5 * noise + 0.01)


@pytest.mark.parametrize(
    ('speed', 'at', 'spikes', 'once_a_turn'),
    [(45.0, at_zero(45.0 * TEN), -400.0, True), (3.0, [100, 333, 480], (60, -45, 50), False)],
    ids=['a fast wheel', 'anywhere'],
)
def test_spikes_of_a_wheel_are_counted_and_mended(speed, at, spikes, once_a_turn):
    rate = np.full_like(TEN, speed)
    rate[at] = spikes
    mended = filtered(log(speed * TEN, rate))
    (told,) = mended.notes
    assert f'{len(at)} spikes' in told and ('once a turn at' in told) == once_a_turn
    np.testing.assert_allclose(mended.dq, speed)


def test_a_joint_that_swings_over_its_zero_has_them_at_one_angle():
    q, rate = np.sin(2 * TEN) + 6.0, 2 * np.cos(2 * TEN)
    rate[at_zero(q)] = 90.0
    (told,) = filtered(log(q, rate)).notes
    assert f'{len(at_zero(q))} spikes' in told and ('all at' in told or 'once a turn at' in told)


@pytest.mark.parametrize('case', ['impact', 'noise', 'coarse', 'late', 'unit'])
def test_what_the_angle_supports_or_noise_makes_is_no_spike(case):
    rng = np.random.default_rng(1)
    q, rate = np.sin(3 * TEN), 3 * np.cos(3 * TEN)
    if case == 'impact':  # bounces back from a stop
        q, rate = np.abs(np.sin(3 * TEN)), 3 * np.cos(3 * TEN) * np.sign(np.sin(3 * TEN) + 1e-12)
    if case == 'noise':
        rate = rate + 0.3 * rng.standard_t(5, size=len(TEN))
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
    states = log(np.sin(TEN), np.full_like(TEN, np.nan))
    assert filtered(states).notes == ()
    assert filtered(replace(states, dq=None)).notes == ()


def test_degrees_taken_for_radians_are_not_unwrapped():
    """Else every sample would count as a wrap, and the log could not be mended by its unit."""
    t = np.arange(0, 4, 0.01)
    q, dq = np.degrees(3 * np.sin(4 * t)), 12 * np.cos(4 * t)
    states = log(q, dq)
    assert unwrapped(states) is states
