# SPDX-License-Identifier: Apache-2.0
"""Missing torque on a pendulum with hidden friction, and the page of a whole explanation."""

from dataclasses import replace

import numpy as np
import pytest
from tests.page import read
from tests.simulate import PENDULUM, record

from leo_diffmodel.bags.recording import Recording
from leo_diffmodel.explain.explanation import explain, Explanation
from leo_diffmodel.report import binned
from leo_diffmodel.report.explained import explanation_page, trace
from leo_sim.effects import place
from leo_sim.model import Model

FRICTION = 1e-4


@pytest.fixture(scope='module')
def recording() -> Recording:
    friction = place(PENDULUM, 'viscous_friction', 'pivot', b=FRICTION)
    return record(PENDULUM, friction, seconds=8, seed=3, noise=(1e-3, 0.03))


@pytest.fixture(scope='module')
def explanation(recording: Recording) -> Explanation:
    return explain([recording], Model(PENDULUM))


def test_missing_torque_has_the_slope_of_friction_and_the_best_candidate(recording, explanation):
    _, missing, curves = trace([recording], explanation.search)
    slope = np.polyfit(missing.dq[:, 0], missing.torque[:, 0], 1)[0]
    assert slope == pytest.approx(-FRICTION, rel=0.1)
    groups = binned.sort(missing.dq[:, 0])
    measured, first = missing.torque[:, 0], next(iter(curves.values()))
    off = groups.mean(measured) - groups.mean(first[:, 0])
    assert np.abs(off / groups.standard_error(measured)).max() < 4
    assert 1 <= len(curves) <= 4


TITLES = (
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
NAMES = 'viscous_friction', 'back_emf_scale', 'N m s/rad', 'nats', 'held-out', 'noise floor'
SHOWN = 'worst predicted windows', 'of stall', 'of held-out turns', 'repaired, training', 'runtime'
DETAILS = 'Autocorrelation of what is left', 'margin_nats', 'Plausible range'


@pytest.mark.parametrize('verdict', ['named', 'unknown'])
def test_the_whole_page(verdict, recording, explanation):
    text = explanation_page(replace(explanation, verdict=verdict), [recording])
    assert f'>{verdict}<' in text
    places = [text.index(f'<h2>{title}</h2>') for title in TITLES]
    assert places == sorted(places)
    for name in (*NAMES, *SHOWN, *DETAILS):
        assert name in text, name
    assert read(text)[0].urls == []


def test_bins_leave_out_thin_ones():
    groups = binned.sort(np.concatenate([np.linspace(0, 1, 100), [50.0]]))
    assert groups.centre.max() < 2
    assert groups.members.sum(axis=1).min() >= binned.FEWEST
