# SPDX-License-Identifier: Apache-2.0
"""What an update of DDPG does between its matrix products, compiled.

All arrays are float32; rows are the members of a batch.
"""

from typing import Any

from numba import njit
import numpy as np

compiled = njit(cache=True, error_model='numpy', fastmath={'contract', 'reassoc'})
"""Sums may be taken in any order, so that several numbers are added at once."""
ZERO, ONE = np.float32(0), np.float32(1)
BETA_1, BETA_2, EPSILON = 0.9, 0.999, np.float32(1e-8)  # Adam's, as torch has them
NORM_EPSILON = np.float32(1e-5)  # added to a variance by layer norm, as torch has it


@compiled
def relu(z: Any, bias: Any) -> None:
    """Add a bias (m,) to (B, m) and cut at zero, in place."""
    for i in range(len(z)):
        for j in range(z.shape[1]):
            z[i, j] = max(z[i, j] + bias[j], ZERO)


@compiled
def norm_relu(z: Any, bias: Any, gain: Any, shift: Any, y: Any) -> Any:
    """Layer norm of z + bias into z, before gain and shift; ReLU behind these into y.

    Returns what each row was multiplied by, (B,).
    """
    scale = np.empty(len(z), np.float32)
    for i in range(len(z)):
        mean, square = ZERO, ZERO
        for j in range(z.shape[1]):
            z[i, j] += bias[j]
            mean += z[i, j] / np.float32(z.shape[1])
        for j in range(z.shape[1]):
            z[i, j] -= mean
            square += z[i, j] * z[i, j]
        scale[i] = ONE / np.sqrt(square / np.float32(z.shape[1]) + NORM_EPSILON)
        for j in range(z.shape[1]):
            z[i, j] *= scale[i]
            y[i, j] = max(z[i, j] * gain[j] + shift[j], ZERO)
    return scale


@compiled
def through_relu(slope: Any, y: Any, through: Any, total: Any) -> None:
    """The gradient by what ReLU was given, `through` (B, m), and its `total` over the batch (m,).

    `slope` is the gradient by what it gave, `y` (B, m); it may be wider.
    """
    total[:] = ZERO
    for i in range(len(y)):
        for j in range(y.shape[1]):
            through[i, j] = slope[i, j] if y[i, j] > ZERO else ZERO
            total[j] += through[i, j]


@compiled
def through_norm(slope: Any, z: Any, scale: Any, gain: Any, by_gain: Any, by_bias: Any) -> None:
    """The gradient by what layer norm was given, in place of that by what it gave, (B, m).

    `z` are rows of mean 0 and variance 1, `scale` what each was multiplied by (see `norm_relu`);
    `by_gain` and `by_bias`, (m,), become the gradients by its gain and by the bias before it.
    """
    by_gain[:] = ZERO
    by_bias[:] = ZERO
    width = np.float32(z.shape[1])
    for i in range(len(slope)):
        mean, along = ZERO, ZERO
        for j in range(z.shape[1]):
            by_gain[j] += slope[i, j] * z[i, j]
            slope[i, j] *= gain[j]
            mean += slope[i, j] / width
            along += slope[i, j] * z[i, j] / width
        for j in range(z.shape[1]):
            slope[i, j] = scale[i] * (slope[i, j] - mean - z[i, j] * along)
            by_bias[j] += slope[i, j]


@compiled
def adam(
    values: Any,
    slope: Any,
    first: Any,
    second: Any,
    slow: Any,
    l2: Any,
    rate: Any,
    steps: Any,
    share: Any,
) -> None:
    """One step of Adam (Kingma and Ba 2015), as torch rounds it; `slow` follows the values.

    `first` and `second` are running means of the gradient `slope` and its square, all (P,); `l2`
    times the values is added to the gradient; `steps` counts this one; `share` of their distance
    to the values is what the followers move.
    """
    step = np.float32(rate / (1 - BETA_1**steps))
    root = np.float32(np.sqrt(1 - BETA_2**steps))
    new, kept, added = np.float32(1 - BETA_1), np.float32(BETA_2), np.float32(1 - BETA_2)
    for i in range(values.size):
        gradient = slope[i] + np.float32(l2) * values[i]
        first[i] += new * (gradient - first[i])
        second[i] = kept * second[i] + added * gradient * gradient
        values[i] -= step * first[i] / (np.sqrt(second[i]) / root + EPSILON)
        slow[i] += share * (values[i] - slow[i])
