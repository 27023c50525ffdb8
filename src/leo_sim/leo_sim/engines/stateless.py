# SPDX-License-Identifier: Apache-2.0
"""What bodies share that are pure arithmetic: no state of their own, rates that hold."""
from typing import Any

from leo_sim.engines.free import Free


class Stateless(Free):
    """The part of `leo_sim.substep.Dynamics` that moves a body."""

    def begin(self, q: Any, dq: Any, h: Any) -> None:
        """Nothing: this body has no state of its own."""

    def move(self, q: Any, dq: Any, faster: Any, h: Any) -> tuple[Any, Any]:
        """The state after the rates became `faster` and held for h s."""
        return q + h * faster, faster
