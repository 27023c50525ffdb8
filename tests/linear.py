# SPDX-License-Identifier: Apache-2.0
"""Selection without a robot: effects whose predictions are straight in their parameters."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from types import SimpleNamespace
from typing import Any

import numpy as np
from tests.simulate import TORQUE

from leo_diffmodel.explain.estimate.estimator import Estimate, Extension
from leo_diffmodel.explain.estimate.fitted import Fit
from leo_diffmodel.explain.problem import likelihood
from leo_diffmodel.explain.problem.candidates import candidates
from leo_diffmodel.explain.problem.hypothesis import Candidate, Hypothesis
from leo_diffmodel.explain.select.evidence import Scored
from leo_diffmodel.explain.settings import SETTINGS
from leo_sim.model import Model

Array = np.ndarray
POOL = {c.effect.name: c for c in candidates(Model(TORQUE)) if len(c.parameters) == 1}
STATES = 2
FAR = 1e6


def posed(fold: Array) -> Any:
    """What a selection reads of a problem: windows of one recording, all trained on."""
    count = len(fold)
    windows = SimpleNamespace(source=np.zeros(count, dtype=int), count=count)
    problem = SimpleNamespace(
        train=np.ones(count, dtype=bool),
        fold=fold,
        windows=windows,
        gates=SETTINGS.gates,
        numerics=SETTINGS.numerics,
        typical_of=lambda residual: None,
        base=SimpleNamespace(robot=SimpleNamespace(actuators=())),
    )
    return SimpleNamespace(problem=problem, longer=None)


def free(names: Sequence[str]) -> Hypothesis:
    """Effects by name, their parameters without bounds."""
    return Hypothesis(tuple(wide(POOL[n]) for n in names))


def wide(candidate: Candidate) -> Candidate:
    """A candidate whose parameters may take any value."""
    kept = tuple(replace(p, low=-FAR, high=FAR) for p in candidate.parameters)
    return replace(candidate, parameters=kept)


def solved(at: Any, hypothesis: Hypothesis, data: Array, columns: dict[str, Array]) -> Estimate:
    """Least squares: data (W, N) by the columns (W, N) of the effects of a hypothesis.

    Of an effect with several parameters the first alone does something.
    """
    names = [c.effect.name for c in hypothesis.candidates]
    seen = np.stack([columns[n] for n in names], axis=-1) if names else np.zeros((*data.shape, 0))
    flat = seen.reshape(data.size, len(names))
    found = np.linalg.lstsq(flat, data.ravel(), rcond=None)[0]
    residual = data - seen @ found
    loss = likelihood.loss(residual, STATES, SETTINGS.numerics)
    first, count = [hypothesis.offset(i) for i in range(len(names))], hypothesis.size
    theta, covariance = np.zeros(count), np.eye(count)
    sensitivity = np.zeros((*data.shape, count))
    theta[first], sensitivity[..., first] = found, -seen
    covariance[np.ix_(first, first)] = np.linalg.inv(flat.T @ flat) if names else 0.0
    start = np.zeros((len(data), STATES))
    known = covariance, np.zeros((count, 2))
    return Estimate(at, Fit(hypothesis, theta, *known, start, loss, residual, sensitivity))


def scored(names: Sequence[str], left: Array, fold: Array) -> Scored:
    """A set that leaves so much of each window, spread evenly over its samples."""
    samples = 40
    residual = np.sqrt(2 * left / samples)[:, None] * np.ones(samples)
    hypothesis, count = free(names), len(names)
    fitted = Fit(
        hypothesis,
        np.ones(count),
        np.eye(count),
        np.zeros((count, 2)),
        np.zeros((len(left), STATES)),
        left,
        residual,
        np.zeros((len(left), samples, count)),
    )
    return Scored(Estimate(posed(fold), fitted), left, fold)


@dataclass
class Regression:
    """An estimator that tries all single effects, and all pairs; see `Estimator`."""

    data: Array
    columns: dict[str, Array]
    at: Any
    threshold: float = 8.0
    pairs: bool = True
    most_nats: float = np.inf

    def first(self, hypothesis: Hypothesis) -> Estimate:
        """The model as given."""
        return solved(self.at, hypothesis, self.data, self.columns)

    def begun(self, first: Estimate, *_: object) -> Estimate:
        """The search begins with the model as given."""
        return first

    def near(
        self, base: Estimate, pool: Sequence[Candidate], told: object, rival: float = np.inf
    ) -> Extension:
        """One and two more effects."""
        pool = [c for c in pool if c not in base.names]
        more = [(c,) for c in pool]
        if self.pairs:
            more += [(c, d) for i, c in enumerate(pool) for d in pool[:i]]
        held = base.fit.hypothesis
        larger = [replace(held, candidates=(*held.candidates, *m)) for m in more]
        fits = [self.refitted(base, h) for h in larger]
        return Extension(base, tuple(fits), (), self.threshold)

    def refitted(
        self,
        at: Estimate,
        hypothesis: Hypothesis,
        theta: Array | None = None,
        rival: float = np.inf,
    ) -> Estimate:
        """Another hypothesis; where it starts from does not matter."""
        return solved(self.at, hypothesis, self.data, self.columns)

    def finished(self, at: Estimate, starts: Sequence[Array]) -> Estimate:
        """As it is."""
        return at

    def ends(self, at: Estimate) -> Array:
        """The last samples of each window, of which a tenth of the noise is seen."""
        return np.asarray(10 * (self.data - at.fit.residual)[:, -STATES:])
