# SPDX-License-Identifier: Apache-2.0
"""The inverse of an inertia, and how a body moves with it: kick and motion of a substep."""

import math
from typing import Any, NamedTuple

import numpy as np

from leo_sim.common.broadcasting import Array, common, Numbers, rows
from leo_sim.common.compiled import compiled_in_place, compiled_without_gil


class Factor(NamedTuple):
    """The inverse of an inertia (..., J, J) plus a diagonal (..., J)."""

    inverse: Any

    def solve(self, right: Array) -> Any:
        """Accelerations (..., J) under the torques `right` (..., J)."""
        size = self.inverse.shape[-1]
        if size == 1:
            return self.inverse[..., 0] * right
        shape = common(self.inverse.shape[:-2], right.shape[:-1])
        out = np.empty((math.prod(shape), size))
        times(rows(self.inverse, shape, (size, size)), rows(right, shape, size), out)
        return out.reshape(*shape, size)

    def response(self, joint: int) -> Any:
        """Rates (..., J) that a unit impulse at a joint causes."""
        return self.inverse[..., joint, :]


def factor(mass: Any, diagonal: Array) -> Factor:
    size, diagonal = mass.shape[-1], np.asarray(diagonal, dtype=float)
    if size == 1:
        return Factor(1.0 / (mass + diagonal[..., None]))
    shape = common(mass.shape[:-2], diagonal.shape[:-1])
    inverse = np.empty((math.prod(shape), size, size))
    invert(rows(mass, shape, (size, size)), rows(diagonal, shape, size), inverse)
    return Factor(inverse.reshape(*shape, size, size))


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
    ) -> tuple[Any, Factor]:
        """Rates (..., J) after h s without impulses, and the factor of the inertia.

        The diagonal, rotors and implicit drag, kg m2, is added to the inertia. Driving torques
        are without the bias, N m; `held` is the same less dry friction, for the mean rates that
        the bias is taken at.
        """
        mass, bias = self.mass_and_bias(q, dq)
        found = factor(mass, diagonal)
        if bias.shape[-1] > 1:
            bias = self.bias(q, dq + (0.5 * h) * found.solve(held - bias))
        return dq + h * found.solve(driving - bias), found


class Compiled(Dynamics):
    """A body whose inertia and bias one compiled function fills, over any leading axes."""

    leading: tuple[int, ...]  # axes of the inertial figures

    def axes(self, q: Array, dq: Array) -> tuple[int, ...]:
        """Leading axes of what is computed for such states."""
        return common(np.shape(q)[:-1], np.shape(dq)[:-1], self.leading)

    def fill(self, shape: tuple[int, ...], q: Array, dq: Array, mass: Array, bias: Array) -> None:
        """Fill bias (N, J) for states (N, J) of these axes, and mass (N, J, J) if it has rows."""
        raise NotImplementedError

    def mass_and_bias(self, q: Array, dq: Array) -> tuple[Any, Any]:
        shape, size = self.axes(q, dq), np.shape(q)[-1]
        mass = np.empty((math.prod(shape), size, size))
        bias = self._filled(shape, q, dq, mass)
        return mass.reshape(*shape, size, size), bias

    def bias(self, q: Array, dq: Array) -> Any:
        size = np.shape(q)[-1]
        return self._filled(self.axes(q, dq), q, dq, np.empty((0, size, size)))

    def _filled(self, shape: tuple[int, ...], q: Array, dq: Array, mass: Array) -> Any:
        size = np.shape(q)[-1]
        states = rows(q, shape, size, True), rows(dq, shape, size, True)
        bias = np.empty(states[0].shape)
        self.fill(shape, *states, mass, bias)
        return bias.reshape(*shape, size)


@compiled_without_gil
def invert(mass: Array, diagonal: Array, inverse: Array) -> None:
    """Fill inverse (N, J, J) with that of mass plus a diagonal (N, J)."""
    size = mass.shape[1]
    for n in range(inverse.shape[0]):
        a = inverse[n]
        for i in range(size):
            for j in range(size):
                a[i, j] = mass[at(mass, n), i, j]
            a[i, i] += diagonal[at(diagonal, n), i]
        inverted(size, 0, a)


@compiled_without_gil
def times(matrix: Array, vector: Array, out: Array) -> None:
    """Fill out (N, J) with matrices (N, J, J) times vectors (N, J)."""
    size = out.shape[1]
    for n in range(out.shape[0]):
        left, right = at(matrix, n), at(vector, n)
        for i in range(size):
            total = 0.0
            for j in range(size):
                total += matrix[left, i, j] * vector[right, j]
            out[n, i] = total


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
