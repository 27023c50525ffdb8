# SPDX-License-Identifier: Apache-2.0
"""Which rates cannot be the derivative of their angle, and which may have noise."""

import numpy as np
import pytest
from tests.hand import spoilt
from tests.simulate import record, TORQUE

from leo_diffmodel.outside.flow import flow
from leo_diffmodel.outside.rate import relate, with_true_rates
from leo_sim.model import Model

RECORDING = record(TORQUE, seconds=10.0)
RATES = RECORDING.episodes[0].dq


def test_a_measured_rate_is_kept():
    assert with_true_rates(RECORDING) is RECORDING
    noisy = RATES + 0.3 * np.random.default_rng(0).standard_normal(RATES.shape)
    assert with_true_rates(spoilt(RECORDING, dq=noisy)).episodes[0].dq is noisy


@pytest.mark.parametrize('false', [6.4 * RATES, -RATES, RATES + 0.5, 0 * RATES])
def test_a_false_rate_is_taken_from_the_angle(false):
    true = with_true_rates(spoilt(RECORDING, dq=false)).episodes[0].dq
    assert np.median(np.abs(true - RATES)) < 0.2


def test_scale_lag_and_zero_of_a_rate():
    found = relate(spoilt(RECORDING, dq=2 * RATES + 0.4), 0)
    assert found.scale[0] == pytest.approx(0.5, abs=5 * found.scale[1])
    assert found.zero[0] == pytest.approx(0.4, abs=5 * found.zero[1])
    assert found.zero[1] < 0.05


def test_a_joint_whose_angle_stays_stands_whatever_its_rate_is():
    (e,) = RECORDING.episodes
    q, dq = e.q.copy(), e.dq.copy()
    q[400:700], dq[400:700] = q[400], 0.3
    seen = flow(spoilt(RECORDING, q=q, dq=dq), Model(TORQUE))
    inside = (seen.time > 4.2) & (seen.time < 6.8)
    assert seen.moving[inside].max() == 0.0 and seen.moving[~inside].mean() > 0.5
