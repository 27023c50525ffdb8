# SPDX-License-Identifier: Apache-2.0
"""The inverse of an inertia, and how a body moves with it: kick and motion of a substep."""

from typing import Any

import numpy as np

from leo_sim.common.broadcasting import Array, Numbers
from leo_sim.common.compiled import compiled_in_place


def inverse_of(mass: Any, diagonal: Array) -> Any:
    """Of an inertia (..., J, J) plus a diagonal (..., J)."""
    if mass.shape[-1] == 1:
        return 1.0 / (mass + np.asarray(diagonal)[..., None])
    return np.linalg.inv(mass + np.asarray(diagonal)[..., None] * np.eye(mass.shape[-1]))


def answered(inverse: Any, torques: Array) -> Any:
    """Accelerations (..., J) under torques (..., J)."""
    return (inverse @ torques[..., None])[..., 0]


class Dynamics:
    """What a substep needs of a body: inertia, bias and load at a state, and its motion.

    Rates hold from one kick to the next; a body with a state of its own has another `begin` and
    `move`.
    """

    # of angles and rates (..., J): joint-space inertia (..., J, J) and bias torques (..., J), in
    # M ddq + bias = torques: gravity, external, Coriolis and centrifugal forces
    mass_and_bias: Any
    bias: Any  # the bias torques alone

    def load(self, q: Array) -> Any:
        """Torque of gravity and external forces at the joints, N m, (..., J), along +q."""
        return -self.bias(q, np.zeros_like(q))

    def begin(self, q: Array, dq: Array, h: Numbers) -> None:
        """Take a state; substeps of h s follow."""

    def move(self, q: Array, dq: Array, faster: Array, h: Numbers) -> tuple[Any, Any]:
        """The state after the rates went from dq to `faster` and then held for h s."""
        return q + h * faster, faster

    def kicked(
        self, q: Array, dq: Array, diagonal: Array, driving: Array, held: Array, h: Numbers
    ) -> tuple[Any, Any]:
        """Rates (..., J) after h s without impulses, and the inverse of the inertia.

        The diagonal, rotors and implicit drag, kg m2, is added to the inertia. Driving torques
        are without the bias, N m; `held` is the same less dry friction, for the mean rates that
        the bias is taken at.
        """
        mass, bias = self.mass_and_bias(q, dq)
        inverse = inverse_of(mass, diagonal)
        if bias.shape[-1] > 1:
            bias = self.bias(q, dq + (0.5 * h) * answered(inverse, held - bias))
        return dq + h * answered(inverse, driving - bias), inverse


@compiled_in_place
def inverted(size: int, held: int, matrix: Array) -> Any:
    """Invert (J, J) in place by Gauss and Jordan; zero for the first `held` joints.

    Without pivoting: an inertia is positive definite.
    """
    for i in range(held):
        for j in range(size):
            matrix[i, j] = matrix[j, i] = 0.0
    for p in range(held, size):
        scale = 1.0 / matrix[p, p]
        matrix[p, p] = 1.0
        for j in range(size):
            matrix[p, j] *= scale
        for i in range(size):
            if i != p:
                factor = matrix[i, p]
                matrix[i, p] = 0.0
                for j in range(size):
                    matrix[i, j] -= factor * matrix[p, j]


@compiled_in_place
def at(values: Array, n: int) -> Any:
    """Index of row n in rows as `broadcasting.rows` makes them."""
    return n if values.shape[0] > 1 else 0


@compiled_in_place
def kicked(
    n: int, answer: Array, torque: Array, bias: Array, dq: Array, h: float, rates: Array
) -> Any:
    """Fill row n of rates (N, J) with those after h s of a torque less the bias.

    The answer is the inverse of the inertia, (J, J).
    """
    t = at(torque, n)
    for i in range(rates.shape[1]):
        total = 0.0
        for j in range(rates.shape[1]):
            total += answer[i, j] * (torque[t, j] - bias[n, j])
        rates[n, i] = dq[n, i] + h * total
