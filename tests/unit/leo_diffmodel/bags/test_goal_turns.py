# SPDX-License-Identifier: Apache-2.0
"""Goals that were wrapped apart from the angle follow its turn; goals that are far away stay."""

import numpy as np
import pytest

from leo_diffmodel.bags.arrays import Run, write_runs
from leo_diffmodel.bags.recording import read_bag
from leo_sim.description.robot import load_robot

SERVO = load_robot('xl330_pendulum')
T = 0.01 * np.arange(800)


def wrapped(angle):
    return (angle + np.pi) % (2 * np.pi) - np.pi


def recorded(folder, q, dq, goal, enabled=None):
    on = np.ones_like(T) if enabled is None else enabled
    inputs = {'pivot': {'position': goal, 'enabled': on}}
    run = Run(T, ['pivot'], q[:, None], dq[:, None], inputs=inputs)
    return read_bag(write_runs(folder / 'bag', [run], {}), SERVO)


WAYS = {
    'on and on': (2 * T, np.full_like(T, 2.0)),
    'back': (-2 * T, np.full_like(T, -2.0)),
    'around pi': (np.pi - 0.1 + 0.3 * np.sin(3 * T), 0.9 * np.cos(3 * T)),
}


@pytest.mark.parametrize('way', WAYS)
@pytest.mark.parametrize('angle', [wrapped, np.asarray])
@pytest.mark.parametrize('asked', [wrapped, np.asarray])
def test_goals_follow_the_turn_of_the_angle(tmp_path, way, angle, asked):
    q, dq = WAYS[way]
    recording = recorded(tmp_path, angle(q), dq, asked(q + 0.05))
    (episode,) = recording.episodes
    np.testing.assert_allclose(episode.inputs - episode.q, 0.05, atol=0.02)
    told = [w for w in recording.warnings if 'wrapped apart' in w]
    assert len(told) == bool(np.abs(asked(q + 0.05) - q - 0.05).max() > 6)


def test_an_angle_that_begins_in_another_turn_than_its_goals(tmp_path):
    q = 4 * np.pi + np.sin(T)
    (episode,) = recorded(tmp_path, wrapped(q), np.cos(T), q + 0.05).episodes
    np.testing.assert_allclose(episode.inputs - episode.q, 0.05, atol=0.02)


@pytest.mark.parametrize(
    'goal',
    [
        np.where(T < 2, 0.0, 4.0),
        np.where((T > 2) & (T < 2.3), 4.0, 0.0),
        np.where(T < 2, -3.1, 3.1),
    ],
)
def test_a_goal_that_steps_far_is_meant(tmp_path, goal):
    rate = np.zeros_like(T)
    q = np.zeros_like(T)
    q[0] = goal[0]
    for k in range(1, len(T)):  # a servo that turns by 2 rad/s at most
        rate[k] = np.clip(5 * (goal[k - 1] - q[k - 1]), -2, 2)
        q[k] = q[k - 1] + 0.01 * rate[k]
    recording = recorded(tmp_path, q, rate, goal)
    assert np.array_equal(recording.episodes[0].inputs[:, 0], goal)
    assert not any('wrapped apart' in w for w in recording.warnings)


def test_a_free_motor_has_no_goal(tmp_path):
    q, dq = WAYS['on and on']
    on = np.where((T > 3) & (T < 4), 0.0, 1.0)
    (episode,) = recorded(tmp_path, wrapped(q), dq, wrapped(q + 0.05), on).episodes
    counts = episode.enabled[:, 0]
    np.testing.assert_allclose((episode.inputs - episode.q)[counts], 0.05, atol=0.02)
    assert not episode.inputs[~counts].any()
