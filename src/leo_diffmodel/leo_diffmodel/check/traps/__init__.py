# SPDX-License-Identifier: Apache-2.0
"""What logs made for something else than identification hide: teleoperation above all."""

from __future__ import annotations

import numpy as np

from leo_diffmodel.bags.recording import Recording
from leo_diffmodel.check.finding import Finding
from leo_diffmodel.check.traps.angle_units import angle_units
from leo_diffmodel.check.traps.asked import asked
from leo_diffmodel.check.traps.even_stamps import even_stamps
from leo_diffmodel.check.traps.frame_shift import frame_shift
from leo_diffmodel.check.traps.positions_only import positions_only
from leo_diffmodel.check.traps.slow import slow
from leo_sim.description.robot import Robot

__all__ = ['traps']


def traps(recording: Recording, robot: Robot) -> list[Finding]:
    """Return what each trap's own file looks for."""
    with np.errstate(all='ignore'):  # whatever numbers a log holds
        return [
            *angle_units(recording, robot),
            *even_stamps(recording),
            *slow(recording),
            *positions_only(recording),
            *asked(recording),
            *frame_shift(recording),
        ]
