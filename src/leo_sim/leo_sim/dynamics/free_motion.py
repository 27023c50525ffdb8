# SPDX-License-Identifier: Apache-2.0
"""The parts of `leo_sim.dynamics.substep.Dynamics` that several bodies share: kick and motion."""

from typing import Any

from leo_sim.common.broadcasting import Array, Numbers
from leo_sim.dynamics.impulses import Factor


class Free:
    """The part of `leo_sim.dynamics.substep.Dynamics` that kicks a body."""

    mass_and_bias: Any
    bias: Any

    def kicked(
        self, q: Array, dq: Array, diagonal: Array, driving: Array, held: Array, h: Numbers
    ) -> tuple[Any, Factor]:
        """Rates (..., J) after h s without impulses, and the factor of the inertia.

        Args:
            q: True angles, (..., J).
            dq: True rates, (..., J).
            diagonal: Added to the inertia: rotors and implicit drag, kg m2, (..., J).
            driving: Torques without the bias, N m, (..., J).
            held: The same less dry friction, for the mean rates that the bias is taken at.
            h: s.
        """
        mass, bias = self.mass_and_bias(q, dq)
        factor = Factor(mass, diagonal)
        if bias.shape[-1] > 1:
            bias = self.bias(q, dq + (0.5 * h) * factor.solve(held - bias))
        return dq + h * factor.solve(driving - bias), factor


class Stateless(Free):
    """A body without a state of its own: its rates hold from one kick to the next."""

    def begin(self, q: Array, dq: Array, h: Numbers) -> None:
        """Nothing: this body has no state of its own."""

    def move(self, q: Array, dq: Array, faster: Array, h: Numbers) -> tuple[Any, Any]:
        """The state after the rates became `faster` and held for h s."""
        return q + h * faster, faster
