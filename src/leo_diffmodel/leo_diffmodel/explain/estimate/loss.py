# SPDX-License-Identifier: Apache-2.0
"""What fits leave, and what one saves of another, on the windows they were fitted to."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from leo_diffmodel.explain.estimate.fitted import Fit
from leo_diffmodel.explain.problem import shooting
from leo_diffmodel.explain.settings import Gates

if TYPE_CHECKING:
    from leo_diffmodel.explain.problem.problem import Problem

Array = np.ndarray


def gain(null: Fit, other: Fit, chosen: Array, most: float = np.inf) -> float:
    """Robust loss saved on the chosen windows [nats].

    Args:
        null: the fit it is saved from.
        other: the fit that saves it.
        chosen: windows, shape (W,).
        most: that a window may say for or against it [nats], see `most_nats`.
    """
    return float(np.clip(null.loss - other.loss, -most, most)[chosen].sum())


def most_nats(problem: Problem, spread: float) -> float:
    """Most that a window may say [nats], of residuals of some dispersion."""
    return problem.gates.window_nats * spread


def gains(null: Fit, others: Sequence[Fit], chosen: Array, most: float) -> list[float]:
    """What each of several fits saves [nats], as `gain`.

    Where a window may say so much only, all may save the most in all windows. They are compared
    with one another then: each saves what the best of them does, less what it is behind that.
    """
    if not np.isfinite(most):
        return [gain(null, f, chosen) for f in others]
    best = others[0]
    for f in others[1:]:
        best = f if gain(best, f, chosen, most) > 0 else best
    saved = gain(null, best, chosen, most)
    return [saved - gain(f, best, chosen, most) for f in others]


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
        gates: what counts.
        ratio: mean squared whitened residual over its expected value, in the median window; on
            the ground in one worse than most, see `rest_of`.
        share: of the model's error (beyond noise) that is left.
        correlation: times by which correlation in time makes what is left less than it seems;
            1 for white noise.
    """

    gates: Gates
    ratio: float
    share: float
    correlation: float = 1.0

    @property
    def _is_correlated(self) -> bool:
        gates = self.gates
        return self.ratio > gates.correlated and self.correlation > gates.correlation

    @property
    def matters(self) -> bool:
        """Whether it is more than noise and a good part of what was missing, or far more."""
        if self.ratio > self.gates.far:
            return True
        correlated = self._is_correlated
        much = self.ratio > self.gates.unexplained or correlated
        return self.share > self.gates.share and much


def rest_of(problem: Problem, null: Fit, final: Fit) -> Rest:
    """What the effects of a fit leave of the error of the model without them.

    On the ground no law is looked for in what does not matter, so this must see one that acts at
    times only: a cable that is slack in most windows.

    Args:
        problem: what they were fitted to.
        null: the fit without the effects.
        final: the fit with them.
    """
    numerics = problem.numerics
    most = 1.0 - numerics.seen_windows / len(final.residual)
    quantile = max(0.5, min(numerics.seen_at, most))
    before, ratio = (unexplained(f, quantile) for f in (null, final))
    correlation = dispersion(final) / max(1.0, unexplained(final))
    share = float(np.clip((ratio - 1.0) / max(before - 1.0, 1e-9), 0.0, 1.0))
    return Rest(problem.gates, ratio, share, correlation)
