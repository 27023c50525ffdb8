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
Progress = Callable[..., None]
"""Hears what was done, and how many steps that were."""


class Steps(NamedTuple):
    """What each trial costs, by and large, beside the scan of a candidate."""

    scan: int = 1
    look: int = 4
    fit: int = 8
    end: int = 64

    def round(self, pool: int, fits: int) -> int:
        """All candidates scanned, so many looked at, the better half of them fitted."""
        return self.scan * pool + self.look * fits + self.fit * ((fits + 1) // 2)


STEPS = Steps()


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
        untried: effects and pairs that there was no time to fit.
    """

    base: Estimate
    larger: tuple[Estimate, ...]
    scans: tuple[Scan, ...]
    threshold: float
    untried: tuple[tuple[Candidate, ...], ...] = ()


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

    def refitted(
        self, at: Estimate, hypothesis: Hypothesis, theta: Array | None = None
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
