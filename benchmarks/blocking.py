# SPDX-License-Identifier: Apache-2.0
"""Dynamixel servos whose next reading takes a second whenever a file `block` is there."""

from pathlib import Path
import time

from leo_msgs_py.values import JointStates
from leo_sim.drivers.dynamixel import DynamixelDriver

ASKED, SECONDS = Path('block'), 1.0


class Blocking(DynamixelDriver):
    """As the driver `dynamixel`; `block` and what it says are in the working directory."""

    def read(self) -> JointStates:
        """Read; before that wait where it is asked for, and say since when [s, monotonic]."""
        if ASKED.exists():
            ASKED.rename('blocked')
            Path('blocked').write_text(f'{time.monotonic():.6f}')
            time.sleep(SECONDS)
        return super().read()
