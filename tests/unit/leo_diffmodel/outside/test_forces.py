# SPDX-License-Identifier: Apache-2.0
"""What stands before the first input though its model would not, and what does not."""

from dataclasses import replace

import numpy as np
import pytest
from tests.simulate import record, TORQUE

from leo_diffmodel.bags.recording import Episode, Recording
from leo_diffmodel.bags.types import at_rows
from leo_diffmodel.check.check import forces
from leo_diffmodel.outside.forces import held
from leo_diffmodel.outside.outside import moved_from_outside, share_outside, without
from leo_sim.effects import place
from leo_sim.model import Model

STOOD, SAMPLES = 1.0, 100
INCLINED = 0.4


def stood(angle: float, noise: float = 1e-3) -> Recording:
    """A recording that begins with a second of standing at an angle from hanging."""
    recording = record(TORQUE, seconds=6.0)
    (e,) = recording.episodes
    rng, none = np.random.default_rng(1), np.zeros((SAMPLES, 1))
    angles = np.pi + angle + noise * rng.standard_normal((SAMPLES, 1))
    inputs = np.where(e.inputs == 0, 1e-3, e.inputs)
    t = np.r_[np.linspace(0.0, STOOD, SAMPLES, endpoint=False), e.t - e.t[0] + STOOD]
    joined = Episode(
        t, np.r_[angles, e.q], np.r_[none, e.dq], np.r_[none, inputs], np.r_[none == 0, e.enabled]
    )
    return replace(recording, episodes=(joined,))


def test_what_somebody_holds_is_left_out_and_is_no_motion():
    recording, model = stood(INCLINED), Model(TORQUE)
    (((begin, end),),) = (f.where for f in held(recording, model))
    assert begin == 0.0 and end == pytest.approx(STOOD, abs=0.02)
    (stretch,) = (f for f in moved_from_outside(recording, model) if f.code == 'held')
    assert share_outside([recording], [[stretch]]) == 0.0
    assert without([recording], [[stretch]])[0].episodes[0].t[0] >= STOOD
    (finding,) = (f for f in forces(recording, model) if f.code == 'held')
    assert 'before the first input' in finding.what and finding.severity == 'warning'


def test_what_would_stand_anyway_is_kept():
    assert held(stood(0.0), Model(TORQUE)) == []
    sticking = place(TORQUE, 'coulomb_friction', 'pivot', c=5.0)
    assert held(stood(INCLINED), Model(TORQUE, [sticking])) == []


def test_a_recording_that_moves_at_once_or_never_has_nothing_held():
    assert held(record(TORQUE, seconds=4.0), Model(TORQUE)) == []
    recording = stood(INCLINED)
    never = at_rows(recording.episodes[0], slice(0, SAMPLES))
    assert held(replace(recording, episodes=(never,)), Model(TORQUE)) == []
