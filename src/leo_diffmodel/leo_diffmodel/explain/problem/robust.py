# SPDX-License-Identifier: Apache-2.0
"""The robust loss that every fit uses: quadratic near zero, linear from 2.5 sigma on."""

from __future__ import annotations

import numpy as np

Array = np.ndarray
HUBER = 2.5


def robust_weight(residual: Array) -> Array:
    """Huber weights: 1 within 2.5 sigma, falling as 1/|r| outside."""
    return np.minimum(1.0, HUBER / np.maximum(np.abs(residual), 1e-12))


def huber(residual: Array) -> Array:
    """Huber loss of each window [nats], from residuals (..., W, N)."""
    size = np.abs(residual)
    loss = np.where(size <= HUBER, 0.5 * size**2, HUBER * (size - 0.5 * HUBER))
    return loss.sum(axis=-1)
