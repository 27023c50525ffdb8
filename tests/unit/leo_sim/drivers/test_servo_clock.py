# SPDX-License-Identifier: Apache-2.0
"""A question that servos heard late is known by their clocks."""

import numpy as np
import pytest

from leo_sim.drivers.dynamixel import ServoClock, TICKS

PERIOD = 0.01


def moments(heard_late, count=400, servos=6, fast=0.0, begun=0.0):
    """Our stamp less the true time of each reading [s]; `heard_late` s by its number."""
    clock, off = ServoClock(), []
    for k in range(count):
        sent = 5.0 + PERIOD * k
        true = sent + heard_late.get(k, 0.0)
        ticks = {
            n: int(1e3 * (1 + fast) * true + begun + n / servos) % TICKS for n in range(servos)
        }
        off.append(clock.moment(sent, true + 0.004, ticks) - true)
    return np.array(off)


@pytest.mark.parametrize('fast', [0.0, 1e-4, -1e-2, 1e-2])
def test_a_reading_that_was_late_is_stamped_late(fast):
    late = {150: 3e-3, 151: 1e-3, 300: 2e-3}
    off = moments(late, fast=fast, begun=32_000)
    assert np.abs(off).max() < 0.4e-3
    assert np.count_nonzero(off) < 30 + len(late)


def test_the_first_readings_are_stamped_when_they_were_asked_for():
    off = moments({3: 3e-3}, count=10)
    assert off[3] == pytest.approx(-3e-3) and np.count_nonzero(off) == 1


def test_no_stamp_is_after_the_answer():
    clock = ServoClock()
    for k in range(50):
        clock.moment(PERIOD * k, PERIOD * k + 0.004, {1: 10 * k})
    assert clock.moment(0.5, 0.503, {1: 520}) == 0.503
