# SPDX-License-Identifier: Apache-2.0
"""What can be wrong with a log. A new fault is a class here, a line below and who looks for it."""

from leo_diffmodel.faults.base import Fault
from leo_diffmodel.faults.catalogue import angle, input_and_time, speed

FAULTS: dict[str, Fault] = {
    fault.name: fault
    for fault in (
        speed.SpeedScale(),
        speed.SpeedSign(),
        speed.SpeedWraps(),
        speed.SpeedSignBit(),
        speed.SpeedZero(),
        speed.SpeedLate(),
        speed.SpeedFilter(),
        angle.AngleScale(),
        angle.AngleSign(),
        angle.AngleZero(),
        angle.GoalAsAngle(),
        angle.GoalExchanged(),
        angle.Frozen(),
        speed.Clipped(),
        angle.Repeated(),
        angle.Quantised(),
        input_and_time.InputScale(),
        input_and_time.InputSign(),
        input_and_time.InputExchanged(),
        input_and_time.InputDead(),
        input_and_time.InputLate(),
        input_and_time.GravityCompensated(),
        input_and_time.TimeStretch(),
    )
}
"""By name."""
