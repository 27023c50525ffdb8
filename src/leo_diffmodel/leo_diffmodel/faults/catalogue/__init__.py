# SPDX-License-Identifier: Apache-2.0
"""What can be wrong with a log. A new fault is a file here, a line below and who looks for it."""

from __future__ import annotations

from leo_diffmodel.faults.base import Fault
from leo_diffmodel.faults.catalogue.angle_scale import AngleScale
from leo_diffmodel.faults.catalogue.angle_sign import AngleSign
from leo_diffmodel.faults.catalogue.angle_zero import AngleZero
from leo_diffmodel.faults.catalogue.clipped import Clipped
from leo_diffmodel.faults.catalogue.frozen import Frozen
from leo_diffmodel.faults.catalogue.goal_as_angle import GoalAsAngle
from leo_diffmodel.faults.catalogue.gravity_compensated import GravityCompensated
from leo_diffmodel.faults.catalogue.input_late import InputLate
from leo_diffmodel.faults.catalogue.input_scale import InputScale
from leo_diffmodel.faults.catalogue.input_sign import InputSign
from leo_diffmodel.faults.catalogue.quantised import Quantised
from leo_diffmodel.faults.catalogue.repeated import Repeated
from leo_diffmodel.faults.catalogue.speed_filter import SpeedFilter
from leo_diffmodel.faults.catalogue.speed_late import SpeedLate
from leo_diffmodel.faults.catalogue.speed_scale import SpeedScale
from leo_diffmodel.faults.catalogue.speed_sign import SpeedSign
from leo_diffmodel.faults.catalogue.speed_zero import SpeedZero
from leo_diffmodel.faults.catalogue.time_stretch import TimeStretch

FAULTS: dict[str, Fault] = {
    fault.name: fault
    for fault in (
        SpeedScale(),
        SpeedSign(),
        SpeedZero(),
        SpeedLate(),
        SpeedFilter(),
        AngleScale(),
        AngleSign(),
        AngleZero(),
        GoalAsAngle(),
        Frozen(),
        Clipped(),
        Repeated(),
        Quantised(),
        InputScale(),
        InputSign(),
        InputLate(),
        GravityCompensated(),
        TimeStretch(),
    )
}
"""By name."""
