# SPDX-License-Identifier: Apache-2.0
"""What fits leave, and what one saves of another, on the windows they were fitted to."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from leo_diffmodel.explain.estimate.fitted import Fit
from leo_diffmodel.explain.problem import shooting
from leo_diffmodel.explain.settings import SETTINGS, Settings

Array = np.ndarray
WINDOW_NATS = 6.0
"""Most that one window with contacts may say, for a dispersion of 1: a contact there may flip."""
MARGIN_NATS = SETTINGS.margin_nats
"""Nats by which the best must be ahead to be named alone: odds of 150 to 1."""
AT_TIMES, FEWEST = 0.85, 4
"""Quantile of windows: a law that acts in a sixth of them is seen; contacts that flip make up
less (ten runs of LEO without an effect: at most 1.15 times the noise here). And how many windows
are above it at least: a push is not to decide."""


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


@dataclass(frozen=True)
class Rest:
    """What the supported effects leave.

    Attributes:
        ratio: mean squared whitened residual over its expected value, in the median window; on
            the ground in one worse than most, see `rest_of`.
        share: of the model's error (beyond noise) that is left.
        correlation: times by which correlation in time makes what is left less than it seems;
            1 for white noise.
        settings: the gates.
    """

    ratio: float
    share: float
    correlation: float = 1.0
    settings: Settings = SETTINGS

    @property
    def _is_correlated(self) -> bool:
        gates = self.settings
        return self.ratio > gates.correlated and self.correlation > gates.correlation

    @property
    def matters(self) -> bool:
        """Whether it is more than noise and a good part of what was missing, or far more."""
        if self.ratio > self.settings.far:
            return True
        correlated = self._is_correlated
        much = self.ratio > self.settings.unexplained or correlated
        return self.share > self.settings.share and much


def rest_of(
    null: Fit, final: Fit, on_ground: bool = False, settings: Settings = SETTINGS
) -> Rest:
    """What the effects of a fit leave of the error of the model without them.

    On the ground no law is looked for in what does not matter, so this must see one that acts at
    times only: a cable that is slack in most windows.

    Args:
        null: the fit without the effects.
        final: the fit with them.
        on_ground: of a robot with contacts.
        settings: the gates.
    """
    windows = len(final.residual)
    quantile = max(0.5, min(AT_TIMES, 1.0 - FEWEST / windows)) if on_ground else 0.5
    before, ratio = (unexplained(f, quantile) for f in (null, final))
    correlation = dispersion(final) / max(1.0, unexplained(final))
    share = float(np.clip((ratio - 1.0) / max(before - 1.0, 1e-9), 0.0, 1.0))
    return Rest(ratio, share, correlation, settings)
