# SPDX-License-Identifier: Apache-2.0
"""What keeps compare and check short on fast recordings of many joints changes no result."""

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest
from tests.simulate import NOISE, record, TORQUE

from leo_diffmodel.bags.recording import Episode, Recording
from leo_diffmodel.check.amplitudes import explained
from leo_diffmodel.check.traces import Trace
from leo_diffmodel.compare import errors, noise
from leo_diffmodel.compare.comparison import compare
from leo_diffmodel.compare.pushes import stepped
from leo_diffmodel.compare.settings import COMPARE
from leo_sim.effects import Parameter
from leo_sim.model import Model
from leo_sim.model.batch import rollout

FINE = Model(TORQUE, integration_step=5e-4)


@pytest.fixture(scope='module')
def bag():
    return record(TORQUE, seconds=12)


def test_predictions_are_no_finer_than_their_errors(bag):
    windows = errors.horizon_windows([bag], FINE, 1.0, 60)
    coarse = stepped(FINE, windows, np.array([NOISE]))
    assert coarse.integration_step > FINE.integration_step
    fine, found = (errors.predict_windows(m, windows, np.array([NOISE])) for m in (FINE, coarse))
    rms = [np.sqrt((p.error**2).mean(axis=(0, 1))) for p in (fine, found)]
    assert rms[1] == pytest.approx(rms[0], rel=0.01)


def test_exact_data_keep_the_step_of_the_model():
    exact = record(TORQUE, seconds=6, noise=(0.0, 0.0))
    windows = errors.horizon_windows([exact], FINE, 0.5, 20)
    assert (
        stepped(FINE, windows, np.full((1, 2), 1e-12)).integration_step < COMPARE.integration_step
    )


def test_a_step_of_five_milliseconds_stays(bag):
    model = Model(TORQUE, integration_step=COMPARE.integration_step)
    assert stepped(model, errors.horizon_windows([bag], model, 0.5), np.array([NOISE])) is model


def test_noise_is_read_from_some_of_many_windows(bag, monkeypatch):
    (every,) = noise.estimate(FINE, noise.short_windows([bag]))
    monkeypatch.setattr(noise, 'COMPARE', replace(COMPARE, noise_windows=60))
    (some,) = noise.estimate(FINE, noise.short_windows([bag]))
    assert some == pytest.approx(every, rel=0.25)
    assert not np.array_equal(some, every)


def test_fast_recordings_are_scored_a_step_and_seconds_ahead():
    data = compare([quick()], FINE, step=0.001).data
    steps = [row['steps'] for row in data['horizon']]
    assert steps == sorted(set(steps)) and steps[:3] == [1, 2, 5]
    assert len(data['noise_floor']['horizon']) == len(steps)


def test_what_a_trace_reproduces_is_read_off_the_cosines():
    rng = np.random.default_rng(0)
    base = rng.standard_normal((20, 900))
    traces = [_trace(rng.standard_normal((n, 20)) @ base, n > 3) for n in (1, 4, 8, 6, 2, 8)]
    stacked = np.concatenate([t.signatures for t in traces])
    for share, trace in zip(explained(traces).T, traces, strict=True):
        plane = np.linalg.svd(trace.signatures, full_matrices=False)[2][:2]
        mixed = ((stacked @ plane.T) ** 2).sum(axis=1) * (len(trace.sizes) > 3)
        single = np.maximum(stacked @ trace.signatures.T, 0.0).max(axis=1) ** 2
        assert share == pytest.approx(np.minimum(np.maximum(mixed, single), 1.0), abs=1e-9)


def quick() -> Recording:
    """Eight seconds at 1 kHz."""
    slow = record(TORQUE, seconds=8)
    inputs = np.repeat(slow.episodes[0].inputs, 10, axis=0)
    q, dq = rollout(FINE, [[0.0]], [[0.0]], inputs[None], 0.001)
    rng, count = np.random.default_rng(1), len(inputs)
    seen = (
        x[0, :count] + s * rng.standard_normal((count, 1))
        for x, s in zip((q, dq), NOISE, strict=True)
    )
    episode = Episode(0.001 * np.arange(count), *seen, inputs, np.ones(inputs.shape, dtype=bool))
    return replace(slow, episodes=(episode,), command_period=0.01)


def _trace(rows: np.ndarray, mixed: bool) -> Trace:
    parameter = Parameter('c', 'N m', role='amplitude')
    candidate = SimpleNamespace(parameters=(parameter,) * (2 if mixed else 1))
    unit = rows / np.linalg.norm(rows, axis=1)[:, None]
    return Trace(candidate, np.ones(len(rows)), np.ones(len(rows)), unit)
