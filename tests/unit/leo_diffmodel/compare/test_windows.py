# SPDX-License-Identifier: Apache-2.0
"""Recordings of high and of mixed rates are brought to one rate without changing what they say."""

from dataclasses import replace

import numpy as np
import pytest
from tests.simulate import POSITION, record, TORQUE

from leo_diffmodel.bags.recording import Recording
from leo_diffmodel.compare.windows import cut, thin
from leo_sim.model import Model
from leo_sim.model.batch import rollout

SLOW = record(TORQUE, seconds=4)


def faster(recording: Recording, factor: int) -> Recording:
    """These states told to be `factor` times as close in time."""
    episodes = tuple(replace(e, t=e.t / factor) for e in recording.episodes)
    return replace(recording, episodes=episodes, command_period=recording.command_period / factor)


def test_mixed_rates_become_one():
    made = thin([faster(SLOW, 10), faster(SLOW, 2), SLOW])
    assert [r.state_period for r in made] == pytest.approx([0.01] * 3)
    assert made[2] is SLOW


def test_episodes_of_two_rates_in_one_bag_become_one():
    both = faster(SLOW, 5).episodes + faster(SLOW, 2).episodes
    made = thin([replace(SLOW, episodes=both)])[0].episodes
    assert [np.median(np.diff(e.t)) for e in made] == pytest.approx([0.004, 0.005])


def test_a_rate_that_is_not_high_stays():
    assert thin([SLOW])[0] is SLOW
    assert thin([faster(SLOW, 2)])[0].episodes[0].t.size == SLOW.episodes[0].t.size


def test_a_thinned_recording_is_predicted_as_well_as_the_full_one():
    model = Model(TORQUE, integration_step=0.001)
    slow = record(TORQUE, seconds=4, noise=(0.0, 0.0))
    (e,) = slow.episodes
    inputs, t = np.repeat(e.inputs, 5, axis=0)[:-4], 0.002 * np.arange(5 * len(e.t) - 4)
    q, dq = rollout(model, e.q[:1], e.dq[:1], inputs[None, :-1], 0.002)
    full = replace(e, t=t, q=q[0], dq=dq[0], inputs=inputs, enabled=np.ones_like(inputs, bool))
    (short,) = thin([replace(slow, episodes=(full,), command_period=0.002)])
    assert short.command_period == pytest.approx(0.004)
    windows = cut([short], 0.3)
    q, _ = rollout(model, windows.q[:, 0], windows.dq[:, 0], windows.inputs, windows.dt)
    assert np.abs(q - windows.q).max() < 1e-3


def test_inputs_are_averaged_over_the_longer_steps():
    full = faster(SLOW, 5)
    (short,) = thin([full])
    (e,), (long,) = full.episodes, short.episodes
    width = np.diff(e.t)[:, None]
    last = np.searchsorted(e.t, long.t[-1])
    total = (e.inputs[:-1] * width)[:last].sum(axis=0)
    np.testing.assert_allclose((long.inputs[:-1] * np.diff(long.t)[:, None]).sum(axis=0), total)


def test_of_goals_windows_keep_more_and_an_episodes_first_sample_stands_for_what_was_before():
    recording = record(POSITION, seconds=3)
    windows, (episode,) = cut([recording], 0.3, history=0.15), recording.episodes
    _, _, goals, _, gaps = windows.history
    assert windows.start[0] == pytest.approx(0.15) and goals.shape[1] == 100
    assert gaps[0] == pytest.approx([1e-9] * 85 + [0.01] * 15)
    assert np.array_equal(
        goals[0], np.concatenate([episode.inputs[[0] * 85], episode.inputs[:15]])
    )
    assert cut([SLOW], 0.3, history=0.15).history[0].shape[1] == 15
