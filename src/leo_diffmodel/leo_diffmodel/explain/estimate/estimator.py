# SPDX-License-Identifier: Apache-2.0
"""The seam between choosing a set of effects and fitting it: smooth motion or contact."""

from abc import ABC, abstractmethod
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from typing import NamedTuple

import numpy as np

from leo_diffmodel.bags.recording import Recording
from leo_diffmodel.compare import errors
from leo_diffmodel.compare.pushes import predict
from leo_diffmodel.compare.windows import Array
from leo_diffmodel.explain.estimate.fit import fit
from leo_diffmodel.explain.estimate.fitted import Fit
from leo_diffmodel.explain.estimate.scan import Scan
from leo_diffmodel.explain.problem.hypothesis import Candidate, Hypothesis
from leo_diffmodel.explain.problem.pose import Posed
from leo_diffmodel.explain.problem.problem import Problem
from leo_diffmodel.explain.problem.sizes import Scales
from leo_diffmodel.explain.settings import Numerics
from leo_msgs_py.console import Reporter

Progress = Callable[..., None]  # is called with what was done, how many steps of what kind
Widened = Callable[[Fit], Fit]  # a fit with other errors
SCAN, FIT, PART = 'scan', 'fit', 'part'
"""Kinds of steps: of a candidate, of a set, and of a set less something, by its linear answer."""


def as_fitted(fitted: Fit) -> Fit:
    return fitted


def steps_ahead(numerics: Numerics, pool: int, rounds: int) -> dict[str, int]:
    """About what so many rounds of the search take, the last fit and what comes after it."""
    fits = rounds * numerics.singles + numerics.last_fits + numerics.law_fits
    parts = rounds * numerics.parts
    return {SCAN: rounds * pool, FIT: fits + numerics.findings_fits, PART: parts}


class Estimate(NamedTuple):
    """A fitted hypothesis, and the problem with the noise and contacts that it settled."""

    posed: Posed
    fit: Fit

    @property
    def problem(self) -> Problem:
        return self.posed.problem

    @property
    def names(self) -> frozenset[Candidate]:
        return frozenset(self.fit.hypothesis.candidates)


Hear = Callable[[Estimate, Estimate], None]
"""Is told the model as given, constants refitted, and the best so far."""


@dataclass(frozen=True)
class Extension:
    """A hypothesis `base`, as settled for this comparison, and the sets near it."""

    base: Estimate
    larger: tuple[Estimate, ...]  # the hypotheses that were fitted
    scans: tuple[Scan, ...]  # what the scan promised of each candidate, most first
    threshold: float  # gain that noise alone can give [nats]
    # effects and pairs that there was no time to fit
    untried: tuple[tuple[Candidate, ...], ...] = ()


@dataclass
class Estimator(ABC):
    posed: Posed
    scales: Scales
    _floor: Array | None = field(default=None, init=False)

    @property
    def most_nats(self) -> float:
        """Most that a window may say for or against a hypothesis [nats], of white residuals."""
        return self.posed.problem.gates.window_nats

    @abstractmethod
    def first(self, hypothesis: Hypothesis) -> Estimate:
        """The model as given, with what is uncertain refitted."""

    def begun(
        self,
        first: Estimate,
        recordings: Sequence[Recording],
        pool: Sequence[Candidate],
        progress: Reporter,
        near: Fit | None = None,
        hear: Callable[[Estimate], None] = lambda _: None,
    ) -> Estimate:
        """Where the search begins: `near` what was chosen before, or the model as given."""
        return self.refitted(first, near.hypothesis, near.theta) if near else first

    @abstractmethod
    def near(
        self, base: Estimate, pool: Sequence[Candidate], progress: Reporter, rival: float = np.inf
    ) -> Extension:
        """The best sets near a fitted one, fitted, unless far behind a `rival`'s loss [nats]."""

    def doubt(self, at: Estimate, pool: Sequence[Candidate], progress: Reporter) -> Widened:
        """What gives fits of a set the errors that small differences about it leave."""
        return as_fitted

    def refitted(
        self, at: Estimate, hypothesis: Hypothesis, theta: Array | None = None
    ) -> Estimate:
        """Another hypothesis on the same windows, from values near those of `at`."""
        begun = fit(at.problem, hypothesis, theta, at.fit.start, by_start=at.fit.by_start)
        return Estimate(at.posed, begun)

    @abstractmethod
    def finished(
        self, at: Estimate, starts: Sequence[Array], progress: Progress, wide: Widened = as_fitted
    ) -> Estimate:
        """The chosen hypothesis at its best, also from other `starts` (P,), with a certificate.

        `wide` gives a fit the errors that an answer says.
        """

    def ends(self, at: Estimate) -> Array:
        """Errors of the states predicted far ahead, in noise floors found once, (V, 2J)."""
        if self._floor is None:
            self._floor = far_floor(at.posed)
        return far_ends(at, self._floor)


def far_ends(at: Estimate, floor: Array) -> Array:
    """Errors at the ends of the longest windows there are, from their measured start, (V, 2J)."""
    problem = at.posed.longer or at.problem
    windows, model = problem.windows, at.fit.hypothesis.model(problem.base, at.fit.theta)
    states = predict(model, windows, windows.measured[:, 0])[:, -1]
    return np.asarray((states - windows.measured[:, -1]) / floor)


def far_floor(posed: Posed) -> Array:
    """Error that the noise of the start makes there with the model as given, median, (2J,)."""
    problem = posed.longer or posed.problem
    made = errors.predict_windows(problem.base, problem.windows, posed.problem.sigma)
    return np.asarray(np.sqrt(np.median(made.floor[:, -1], axis=0)))


def at_joints(square: Array) -> Array:
    """Mean of squares (2J,) of states at each joint, (J,)."""
    return np.asarray(square.reshape(2, -1).mean(axis=0))


def most_floors(change: Array) -> float:
    """Root mean square of changes of far states (V, 2J) [noise floors], of the joint with most."""
    with np.errstate(over='ignore'):  # of a set that lets predictions run away
        return float(np.sqrt(at_joints((change**2).mean(axis=0)).max()))
