# SPDX-License-Identifier: Apache-2.0
"""What the supported effects leave unexplained, and whether it matters."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from leo_diffmodel.explain.estimate.fitted import Fit
from leo_diffmodel.explain.estimate.loss import dispersion, unexplained
from leo_diffmodel.explain.settings import SETTINGS, Settings

AT_TIMES, FEWEST = 0.85, 4
"""Quantile of windows: a law that acts in a sixth of them is seen; contacts that flip make up
less (ten runs of LEO without an effect: at most 1.15 times the noise here). And how many windows
are above it at least: a push is not to decide."""


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


def share_left(before: float, after: float) -> float:
    """Share of the model's error beyond noise that the named effects leave, 0 to 1.

    Args:
        before: mean squared whitened residual over its expected value, model as given.
        after: the same with the effects.
    """
    return float(np.clip((after - 1.0) / max(before - 1.0, 1e-9), 0.0, 1.0))


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
    return Rest(ratio, share_left(before, ratio), correlation, settings)
