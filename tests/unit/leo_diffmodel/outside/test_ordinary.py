# SPDX-License-Identifier: Apache-2.0
"""The sine that is strongest in what is left over."""

import numpy as np
import pytest

from leo_diffmodel.outside.ordinary import strongest_wave


@pytest.mark.parametrize('hertz', [0.25, 1.3, 5.8])
@pytest.mark.parametrize('seconds', [12.0, 3600.0])
def test_its_frequency_is_found_however_long_the_recording_is(hertz, seconds):
    time = np.sort(np.random.default_rng(0).uniform(3.0, 3.0 + seconds, 4000))
    rest = 2.0 + np.cos(2 * np.pi * hertz * time + 0.7)
    waves = np.stack([law.torque for law in strongest_wave(time, rest, time > 0)], axis=1)
    left = rest - 2.0 - waves @ np.linalg.lstsq(waves, rest - 2.0, rcond=None)[0]
    assert np.sqrt((left**2).mean()) < 0.1 * np.sqrt(0.5)


def test_a_pause_of_years_costs_nothing():
    time = np.r_[np.arange(0.0, 10.0, 0.03), 2e8 + np.arange(0.0, 10.0, 0.03)]
    laws = strongest_wave(time, np.sin(time), time >= 0)
    assert all(np.isfinite(law.torque).all() for law in laws)
