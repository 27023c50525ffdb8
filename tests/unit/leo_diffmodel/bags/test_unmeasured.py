# SPDX-License-Identifier: Apache-2.0
"""Rates and efforts that nobody measured are said so, joint by joint, and never an input."""

import numpy as np
import pytest
from tests.messages import bag_of, state

from leo_diffmodel.bags.recording import read_bag
from leo_diffmodel.bags.topic_map import TopicMap
from leo_diffmodel.bags.types import JOINT_STATE
from leo_msgs_py.errors import UserError
from leo_sim.description.robot import load_robot

PENDULUM, ARM = load_robot('torque_pendulum'), load_robot('double_pendulum')
STEP = 10_000_000
T = 0.01 * np.arange(200)


def bag(folder, joints, q, dq, effort=None):
    columns = [np.column_stack(c) if c else np.zeros((len(T), 0)) for c in (q, dq, effort or [])]
    rows = [
        ('/joint_states', JOINT_STATE, k * STEP, state(k * STEP, joints, *(c[k] for c in columns)))
        for k in range(len(T))
    ]
    return bag_of(folder, *rows)


def told(recording):
    return [w for w in recording.warnings if 'no measurement' in w]


@pytest.mark.parametrize('value', [-5.4e-310, 3e-320])
def test_memory_that_nobody_wrote_is_no_effort(tmp_path, value):
    effort = np.where(T < 1.0, value, 0.0)
    log = bag(tmp_path, ['pivot'], [np.sin(T)], [np.cos(T)], [effort])
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
    log = bag(tmp_path, ['pivot'], [0 * T], [0 * T], [0 * T])
    recording = read_bag(log, PENDULUM)
    assert recording.input == 'torque' and told(recording) == []
