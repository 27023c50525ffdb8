# SPDX-License-Identifier: Apache-2.0
"""The time of an emulated bus is told over its pseudo-terminal, and taken from no other line."""

import os

from tests.drivers.clock import Clock

from leo_sim.drivers import listening
from leo_sim.drivers.listening import answering_time, tell, told


def test_a_pseudo_terminal_tells_and_a_real_line_does_not(monkeypatch):
    ours, theirs = os.openpty()
    try:
        assert told(theirs) == 0.0
        assert answering_time(theirs, clock := Clock()) == clock.monotonic
        tell(ours, 2.5)
        assert told(theirs) > 2.4
        monkeypatch.setattr(listening, 'PSEUDO', range(4, 5))  # as a serial port would be
        assert told(theirs) == 0.0
    finally:
        os.close(ours)
        os.close(theirs)
    assert told(theirs) == 0.0
