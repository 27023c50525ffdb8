# SPDX-License-Identifier: Apache-2.0
"""What fits leave, and what one saves of another, on the windows they were fitted to."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from leo_diffmodel.explain.estimate.fitted import Fit
from leo_diffmodel.explain.problem import shooting
from leo_diffmodel.explain.settings import SETTINGS

Array = np.ndarray
WINDOW_NATS = 6.0
"""Most that one window with contacts may say, for a dispersion of 1: a contact there may flip."""
MARGIN_NATS = SETTINGS.margin_nats
"""Nats by which the best must be ahead to be named alone: odds of 150 to 1."""


def gain(null: Fit, other: Fit, chosen: Array, spread: float = np.inf) -> float:
    """Robust loss saved on the chosen windows [nats].

    Args:
        null: the fit it is saved from.
        other: the fit that saves it.
        chosen: windows, shape (W,).
        spread: dispersion of the residuals, which limits what a window may say on the ground.
    """
    most = WINDOW_NATS * spread
    return float(np.clip(null.loss - other.loss, -most, most)[chosen].sum())


def gains(null: Fit, others: Sequence[Fit], chosen: Array, spread: float) -> list[float]:
    """What each of several fits saves [nats], as `gain`.

    Where a window may say so much only, all may save the most in all windows. They are compared
    with one another then: each saves what the best of them does, less what it is behind that.
    """
    if not np.isfinite(spread):
        return [gain(null, f, chosen) for f in others]
    best = others[0]
    for f in others[1:]:
        best = f if gain(best, f, chosen, spread) > 0 else best
    most = gain(null, best, chosen, spread)
    return [most - gain(f, best, chosen, spread) for f in others]


def dispersion(fitted: Fit) -> float:
    """How many times the residual exceeds white noise; see `shooting.dispersion`."""
    return shooting.dispersion(fitted.residual, fitted.start.shape[-1])


def unexplained(fitted: Fit, quantile: float = 0.5) -> float:
    """Mean squared whitened residual over its expected value: 1 where only noise is left.

    Args:
        fitted: the fit.
        quantile: over windows; the median does not see what shows in less than half of them.
    """
    return shooting.excess(fitted.residual, fitted.start.shape[-1], quantile)
