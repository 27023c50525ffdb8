# SPDX-License-Identifier: Apache-2.0
"""What can be wrong with a log. A new fault is a class in one of these, and who looks for it."""

from leo_diffmodel.faults.base import Fault
from leo_diffmodel.faults.catalogue import angle, input_and_time, speed

FAULTS: dict[str, Fault] = {
    kind.name: kind()
    for module in (speed, angle, input_and_time)
    for kind in vars(module).values()
    if isinstance(kind, type) and issubclass(kind, Fault)
    if kind.__module__ == module.__name__
}
"""By name."""
