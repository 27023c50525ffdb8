# SPDX-License-Identifier: Apache-2.0
"""Joint states that are read late, seen from the readings alone.

Where y(t) = x(t - d) is the joint state d s ago, y' = f(y(t), u(t - d)): windows that start from
readings need no state of the joints themselves, only inputs and `enabled` that act d s late.
"""

from typing import Any

import numpy as np

from leo_sim.common.broadcasting import Array, Numbers
from leo_sim.effects.command_delay import CommandDelay
from leo_sim.laws.placement import Use

DELAY = CommandDelay()


def act_late(
    use: Use, u: Array, enabled: np.ndarray | None, memory: Any, h: Numbers
) -> tuple[Any, Any, Any]:
    """Inputs and the share of the next h s that each motor is on, and the new memory.

    Args:
        use: The measurement delay.
        u: Inputs held over the next h s, (..., A).
        enabled: Booleans or shares (..., A), or None for all on.
        memory: What this function returned before, None at the start.
        h: s.
    """
    off = np.zeros_like(u) if enabled is None else 1.0 - np.asarray(enabled, dtype=float)
    both = np.concatenate(np.broadcast_arrays(u, off), axis=-1)
    both, memory = DELAY.command(use.values, both, memory, h)
    u, off = np.split(both, 2, axis=-1)
    return u, 1.0 - off if off.any() else None, memory
