# SPDX-License-Identifier: Apache-2.0
"""Inverse of an inertia, compiled."""

from typing import Any

from leo_sim.common.broadcasting import Array
from leo_sim.common.compiled import compiled_in_place


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
