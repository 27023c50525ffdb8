# SPDX-License-Identifier: Apache-2.0
"""A fitted hypothesis."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import asdict, dataclass, replace

import numpy as np

from leo_diffmodel.explain.problem.hypothesis import Hypothesis

Array = np.ndarray


@dataclass(frozen=True)
class Certificate:
    """How surely a fit rests at the least loss there is.

    Attributes:
        decrement: what a full Gauss-Newton step still promises to save [nats].
        starts: from how many values it was fitted.
        reached: how many of these ended at the least loss.
        converged: whether that is enough to trust it.
    """

    decrement: float
    starts: int
    reached: int
    converged: bool

    def to_json(self) -> dict[str, float]:
        """All of it by name."""
        return asdict(self)


@dataclass(frozen=True)
class Fit:
    """A fitted hypothesis.

    Attributes:
        hypothesis: what was free.
        theta: its parameters, shape (P,).
        covariance: of theta, from the training windows, wider where more than noise is left,
            shape (P, P).
        start: start states, shape (W, 2J).
        loss: robust cost of each window [nats], shape (W,).
        residual: whitened, start states projected out, shape (W, N).
        columns: its sensitivity to the parameters, shape (W, N, P).
        decrement: what a full Gauss-Newton step still promises to save [nats].
        typical: size of what it is off by in most windows [noise], (1, 2J), see `shooting.loss`.
        certificate: of one that was brought to its end.
        ended: no step promised anything more; False where the iterations or the time were over.
    """

    hypothesis: Hypothesis
    theta: Array
    covariance: Array
    start: Array
    loss: Array
    residual: Array
    columns: Array
    decrement: float = 0.0
    typical: Array | None = None
    certificate: Certificate | None = None
    ended: bool = True

    def take(self, index: Array) -> Fit:
        """The fit as it is on some of its windows."""
        return replace(
            self,
            start=self.start[index],
            loss=self.loss[index],
            residual=self.residual[index],
            columns=self.columns[index],
        )

    def reordered(self, order: Sequence[int]) -> Fit:
        """The fit with its effects in another order."""
        full = self.hypothesis
        first = [full.offset(i) for i in order]
        counts = [len(full.candidates[i].parameters) for i in order]
        own = [np.arange(f, f + n) for f, n in zip(first, counts, strict=True)]
        index = np.concatenate([*own, np.arange(sum(counts), full.size)]).astype(int)
        candidates = tuple(full.candidates[i] for i in order)
        return replace(
            self,
            hypothesis=replace(full, candidates=candidates),
            theta=self.theta[index],
            covariance=self.covariance[np.ix_(index, index)],
            columns=self.columns[..., index],
        )

    @property
    def standard_errors(self) -> Array:
        """Standard error of each parameter, shape (P,); 0 for one that lies on a bound."""
        return np.sqrt(np.maximum(np.diagonal(self.covariance), 0.0))

    def ci95(self, index: int) -> tuple[float, float]:
        """95 % confidence interval of parameter `index`, within its bounds."""
        half = 1.96 * float(self.standard_errors[index])
        low, high = self.hypothesis.low[index], self.hypothesis.high[index]
        value = float(self.theta[index])
        return max(value - half, float(low)), min(value + half, float(high))
