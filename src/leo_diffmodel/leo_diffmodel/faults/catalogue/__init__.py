# SPDX-License-Identifier: Apache-2.0
"""What can be wrong with a log. A new fault is a class here, a line below and who looks for it."""

from __future__ import annotations

from leo_diffmodel.faults.base import Fault
from leo_diffmodel.faults.catalogue.angle import (
    AngleScale,
    AngleSign,
    AngleZero,
    Frozen,
    GoalAsAngle,
    GoalExchanged,
    Quantised,
    Repeated,
)
from leo_diffmodel.faults.catalogue.input_and_time import (
    GravityCompensated,
    InputDead,
    InputExchanged,
    InputLate,
    InputScale,
    InputSign,
    TimeStretch,
)
from leo_diffmodel.faults.catalogue.speed import (
    Clipped,
    SpeedFilter,
    SpeedLate,
    SpeedScale,
    SpeedSign,
    SpeedSignBit,
    SpeedWraps,
    SpeedZero,
)

FAULTS: dict[str, Fault] = {
    fault.name: fault
    for fault in (
        SpeedScale(),
        SpeedSign(),
        SpeedWraps(),
        SpeedSignBit(),
        SpeedZero(),
        SpeedLate(),
        SpeedFilter(),
        AngleScale(),
        AngleSign(),
        AngleZero(),
        GoalAsAngle(),
        GoalExchanged(),
        Frozen(),
        Clipped(),
        Repeated(),
        Quantised(),
        InputScale(),
        InputSign(),
        InputExchanged(),
        InputDead(),
        InputLate(),
        GravityCompensated(),
        TimeStretch(),
    )
}
"""By name."""
