# SPDX-License-Identifier: Apache-2.0
"""What the motion of a joint predicts of its input, and which of two readings predicts better."""

from dataclasses import replace

import numpy as np
import pytest
from tests.simulate import record, TORQUE

from leo_diffmodel.faults.left_out import better, misses, Reading, split
from leo_diffmodel.outside.flow import flow
from leo_sim.effects import place
from leo_sim.model import Model


@pytest.fixture(scope='module')
def seen():
    rough = place(TORQUE, 'coulomb_friction', 'pivot', c=0.9)
    return flow(record(TORQUE, rough, seconds=30), Model(TORQUE))


def test_friction_that_takes_most_of_the_torque_does_not_make_the_motor_weak(seen):
    as_logged, weak, turned = (misses(seen, 0, Reading(unit)) for unit in (1.0, 12.0, -1.0))
    assert np.nanmean(as_logged) < 0.05 * np.abs(seen.motor).mean()
    assert better([as_logged], [weak]) < 0 and better([as_logged], [turned]) < 0


@pytest.mark.parametrize('unit', [12.0, -1.0])
def test_the_unit_that_a_log_has_predicts_best(seen, unit):
    other = unit * seen.motor
    missing = seen.missing + seen.motor - other
    wrong = replace(seen, motor=other, before=unit * seen.before, missing=missing)
    assert better([misses(wrong, 0)], [misses(wrong, 0, Reading(unit))]) > 2


def test_better_counts_in_standard_errors_over_the_blocks():
    first, second = np.array([1.0, 1.2, 0.8, 1.0]), np.array([0.5, 0.7, 0.5, 0.3])
    apart = 2 * (first - second) / (first + second)
    assert better([first], [second]) == pytest.approx(apart.mean() / (apart.std(ddof=1) / 2))
    assert better([second], [first]) < 0
    assert better([first], [first]) == 0.0
    assert better([np.array([1.0, np.nan])], [np.array([0.5, np.nan])]) == 0.0


def test_blocks_are_equal_shares_in_order():
    assert split(np.arange(16.0)) == pytest.approx(np.arange(8) * 2 + 0.5)
    assert np.isnan(split(np.ones(3))).sum() == 5
