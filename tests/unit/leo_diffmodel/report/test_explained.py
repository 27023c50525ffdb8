# SPDX-License-Identifier: Apache-2.0
"""Missing torque on a pendulum with hidden friction, and the page of a whole explanation."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from tests.page import read

from leo_diffmodel.bags.recording import Episode, Recording
from leo_diffmodel.explain.explanation import explain, Explanation
from leo_diffmodel.report import binned
from leo_diffmodel.report.explained import explanation_page, trace
from leo_sim.description.robot import load_robot
from leo_sim.effects import place
from leo_sim.model import Model

FRICTION = 1e-4
SAMPLES, PERIOD, HELD = 800, 0.01, 10


@pytest.fixture(scope='module')
def recording() -> Recording:
    """8 s of random voltage steps on a pendulum with viscous friction, with sensor noise."""
    robot = load_robot('pendulum')
    model = Model(robot, effects=(place(robot, 'viscous_friction', 'pivot', b=FRICTION),))
    rng = np.random.default_rng(3)
    volts = np.repeat(rng.uniform(-3, 3, SAMPLES // HELD), HELD)[:, None]
    state, seen = model.start(), []
    for u in volts:
        seen.append(np.concatenate(model.sense(state)))
        state = model.step(state, u, PERIOD)
    q, dq = (np.array(seen) + rng.normal(0, [1e-3, 0.03], (SAMPLES, 2))).T[:, :, None]
    episode = Episode(np.arange(SAMPLES) * PERIOD, q, dq, volts, np.ones_like(volts, bool))
    return Recording(
        Path('bags/friction'), '0' * 64, ('pivot',), ('pivot',), 'voltage', 0.03, (episode,), {}
    )


@pytest.fixture(scope='module')
def explanation(recording: Recording) -> Explanation:
    return explain([recording], Model(load_robot('pendulum')))


def test_missing_torque_has_the_slope_of_the_hidden_friction(recording, explanation):
    _, measured, _ = trace([recording], explanation.search)
    slope = np.polyfit(measured.dq[:, 0], measured.torque[:, 0], 1)[0]
    assert slope == pytest.approx(-FRICTION, rel=0.1)


def test_the_leading_candidate_runs_through_the_measured_means(recording, explanation):
    _, missing, curves = trace([recording], explanation.search)
    groups = binned.sort(missing.dq[:, 0])
    measured, first = missing.torque[:, 0], next(iter(curves.values()))
    off = groups.mean(measured) - groups.mean(first[:, 0])
    assert np.abs(off / groups.standard_error(measured)).max() < 4
    assert 1 <= len(curves) <= 4


@pytest.mark.parametrize('verdict', ['named', 'unknown'])
def test_the_whole_page(verdict, recording, explanation):
    text = explanation_page(replace(explanation, verdict=verdict), [recording])
    assert f'>{verdict}<' in text
    titles = (
        'Where the error goes',
        'Where it fails',
        'Torque the model lacks',
        'Hypotheses',
        'How stable is the answer',
        'Error against prediction horizon',
        'Is what is left only noise?',
        'What this data could not test',
        'What decided',
        'Where this comes from',
    )
    places = [text.index(f'<h2>{title}</h2>') for title in titles]
    assert places == sorted(places)
    for name in (
        'viscous_friction',
        'back_emf_scale',
        'N m s/rad',
        'nats',
        'held-out',
        'repaired, training',
        'noise floor',
        'worst predicted windows',
        'of stall',
        'Autocorrelation of what is left',
        'of held-out turns',
        'margin_nats',
        'Plausible range',
        'runtime',
    ):
        assert name in text, name
    assert read(text)[0].urls == []


def test_bins_leave_out_thin_ones():
    groups = binned.sort(np.concatenate([np.linspace(0, 1, 100), [50.0]]))
    assert groups.centre.max() < 2
    assert groups.members.sum(axis=1).min() >= binned.FEWEST
