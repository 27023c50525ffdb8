# SPDX-License-Identifier: Apache-2.0
"""Whole turns are undone where the velocity tells, and only there."""

import numpy as np

from leo_diffmodel.bags.split import unwrapped
from leo_diffmodel.bags.states import StateLog


def test_degrees_taken_for_radians_are_not_unwrapped():
    """Else every sample would count as a wrap, and the log could not be mended by its unit."""
    t = np.arange(0, 4, 0.01)
    q, dq = np.degrees(3 * np.sin(4 * t)), 12 * np.cos(4 * t)
    stamps = np.round(t * 1e9).astype(np.int64)
    states = StateLog(stamps, stamps, stamps, q[:, None], dq[:, None], None, 0, True)
    same, turns = unwrapped(states)
    assert turns == 0 and same.q is states.q
