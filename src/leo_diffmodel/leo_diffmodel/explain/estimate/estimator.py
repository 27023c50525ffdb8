# SPDX-License-Identifier: Apache-2.0
"""The seam between choosing a set of effects and fitting it: smooth motion or contact."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import NamedTuple, Protocol

import numpy as np

from leo_diffmodel.explain.estimate.fitted import Fit
from leo_diffmodel.explain.estimate.scan import Scan
from leo_diffmodel.explain.problem.hypothesis import Candidate, Hypothesis
from leo_diffmodel.explain.problem.pose import Posed
from leo_diffmodel.explain.problem.problem import Problem

Array = np.ndarray
Progress = Callable[[str], None]


class Estimate(NamedTuple):
    """A fitted hypothesis, and the problem with the noise and contacts that it settled."""

    posed: Posed
    fit: Fit

    @property
    def problem(self) -> Problem:
        """The windows that it was fitted to."""
        return self.posed.problem

    @property
    def names(self) -> frozenset[Candidate]:
        """Its effects, in no order."""
        return frozenset(self.fit.hypothesis.candidates)


@dataclass(frozen=True)
class Extension:
    """A hypothesis, and those that one or two effects make of it.

    Attributes:
        base: the hypothesis, as settled for this comparison.
        larger: the hypotheses that were fitted.
        scans: what the scan promised of each candidate, most first.
        threshold: gain that noise alone can give [nats].
    """

    base: Estimate
    larger: tuple[Estimate, ...]
    scans: tuple[Scan, ...]
    threshold: float


class Estimator(Protocol):
    """Fits hypotheses to recordings."""

    @property
    def most_nats(self) -> float:
        """What a single window may say for or against a hypothesis [nats], of white residuals."""

    def first(self, hypothesis: Hypothesis) -> Estimate:
        """The model as given, with what is uncertain refitted."""

    def extended(
        self, base: Estimate, pool: Sequence[Candidate], told: Progress, few: bool = False
    ) -> Extension:
        """The most promising effects of a pool, each fitted jointly with what `base` holds.

        Args:
            base: the hypothesis.
            pool: the effects.
            told: hears what is being tried.
            few: no pairs of effects.
        """

    def refitted(self, at: Estimate, hypothesis: Hypothesis, theta: Array | None = None
                 ) -> Estimate:
        """Another hypothesis on the same windows, from values near those of `at`."""

    def finished(self, at: Estimate, starts: Sequence[Array]) -> Estimate:
        """The chosen hypothesis brought to its best, with its certificate.

        Args:
            at: the hypothesis where the search left it.
            starts: other values to begin with, each (P,).
        """

    def ends(self, at: Estimate) -> Array:
        """Errors of the states predicted far ahead, in noise floors there, (V, 2J)."""
