# SPDX-License-Identifier: Apache-2.0
"""The inputs act later, or earlier, than their stamps say."""

from __future__ import annotations

from leo_diffmodel.bags.mend import with_inputs_late
from leo_diffmodel.bags.recording import Episode
from leo_diffmodel.faults.base import Fault, Patch


class InputLate(Fault):
    """The inputs act later, or earlier, than their stamps say: two clocks, a queue."""

    name = 'input_late'
    channel = 'input'
    unit = 's'
    law = 'u(t) = u_log(t - d)'
    harmless = (0.0, 0.06)
    """s: what explain tries as `command_delay` and `actuator_lag`; a sample before that may be
    how states and inputs share a row."""
    looks_like = 'The motor acts before its command, or long after it.'
    confused_with = 'command_delay, actuator_lag (the same, small); friction at turning points.'
    costs = 'Damping, inertia and delays come out wrong together.'
    whole_log = True

    def spoil(self, e: Episode, j: int, a: int, value: float) -> Episode:
        return with_inputs_late(e, [-value] * e.inputs.shape[1])

    def patch(self, value: float) -> Patch:
        return {'input_late': value}
