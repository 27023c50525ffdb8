# SPDX-License-Identifier: Apache-2.0
"""The mean of a held input over each step."""

from itertools import pairwise

from hypothesis import given
from hypothesis import strategies as st
import numpy as np

from leo_diffmodel.bags.held import average

stamps = st.lists(st.integers(0, 200), min_size=1, max_size=30, unique=True).map(sorted)


@given(stamps, stamps, st.integers(0, 2**32 - 1))
def test_mean_over_each_step_is_that_of_the_finely_sampled_signal(times, switches, seed):
    switches = np.array(switches, dtype=np.int64)
    t = np.array([k for k in times if k >= switches[0]] or [201], dtype=np.int64)
    values = np.random.default_rng(seed).normal(size=(len(switches), 2))
    fine = values[np.searchsorted(switches, np.arange(202), side='right') - 1]
    expected = [fine[a:b].mean(axis=0) for a, b in pairwise(t)]
    expected.append(fine[t[-1]])
    np.testing.assert_allclose(average(t, switches, values), expected, atol=1e-12)


def test_coinciding_stamps_give_the_values_to_the_bit():
    t = np.cumsum(np.random.default_rng(0).integers(1, 10**8, 500))
    values = np.random.default_rng(1).normal(size=(500, 3))
    assert np.array_equal(average(t, t, values), values)
