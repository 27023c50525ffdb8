# SPDX-License-Identifier: Apache-2.0
"""A candidate with its fit, and what the fit is worth."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from leo_diffmodel.explain.estimate import shooting
from leo_diffmodel.explain.estimate.fit import Fit
from leo_diffmodel.explain.estimate.hypothesis import Candidate

Array = np.ndarray
AGREEMENT = 0.1
TELLING_NATS = 2.0
NEUTRAL_SIGMAS = 3.0
WHOLE = 1.3
"""Most that is left, in units of noise, where nothing more is missing."""
MARGIN_NATS = 5.0
"""Nats by which the best must be ahead to be named alone: odds of 150 to 1."""


@dataclass(frozen=True)
class Scored:
    """One candidate fitted on top of the present hypothesis.

    Attributes:
        candidate: the effect and its place.
        fit: the joint fit, None where the scan already ruled it out.
        gain_train: loss saved on the training windows [nats].
        gain_held_out: loss saved on the windows no fit saw [nats].
        evidence: what the largest amplitude tried could give in this data [nats].
        expected_held_out: what `gain_train` promises for the windows no fit saw [nats], by how
            much the candidate changes the prediction there.
        dispersion: how many times what is left exceeds white noise; see `dispersion`.
        decider: nats by which longer windows put it behind the best of its rivals, 0 or less.
        away: how far the surest of its parameters is from neutral, in standard deviations.
    """

    candidate: Candidate
    fit: Fit | None
    gain_train: float
    gain_held_out: float
    evidence: float
    expected_held_out: float = 0.0
    dispersion: float = 1.0
    decider: float = 0.0
    away: float = np.inf

    @property
    def confirmed(self) -> bool:
        """Whether held-out windows agree: they gain, and not a mere trace of what they should.

        Held-out windows that could hardly show the effect have no say. Where contacts may flip, a
        few windows can gain much from a change that all of them together do not show.
        """
        if self.away < NEUTRAL_SIGMAS:
            return False
        if self.expected_held_out < TELLING_NATS:
            return self.gain_held_out > -TELLING_NATS
        return self.gain_held_out > AGREEMENT * self.expected_held_out

    @property
    def score(self) -> float:
        """Training gain less the price of its parameters (half a log of the sample count each).

        What is held out takes no part in the choice; it only has to agree.
        """
        if self.fit is None:
            return self.weight_of_evidence
        return self.weight_of_evidence - self.price + self.decider

    @property
    def weight_of_evidence(self) -> float:
        """Training gain [nats] as it counts where the rest is more than white noise."""
        return self.gain_train / self.dispersion

    @property
    def total(self) -> float:
        """Gain on all windows [nats], discounted alike; the parameters saw the training ones."""
        return (self.gain_train + self.gain_held_out) / self.dispersion

    @property
    def price(self) -> float:
        """Nats that the candidate's parameters must earn (Bayesian information criterion)."""
        assert self.fit is not None
        return 0.5 * len(self.candidate.parameters) * float(np.log(self.fit.residual.size))


def away(fitted: Fit, candidate: Candidate) -> Array:
    """How far the parameters of an effect are from neutral, in standard deviations, shape (n,)."""
    hypothesis = fitted.hypothesis
    first = hypothesis.offset(hypothesis.candidates.index(candidate))
    own = slice(first, first + len(candidate.parameters))
    deviation = np.sqrt(np.diagonal(fitted.covariance))[own]
    return np.abs(fitted.theta - hypothesis.neutral)[own] / np.maximum(deviation, 1e-300)


def shows(fitted: Fit, candidate: Candidate) -> bool:
    """Whether every parameter of an effect does something to the prediction at its values."""
    return bool(np.all(away(fitted, candidate) >= 1.0))


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
