# SPDX-License-Identifier: Apache-2.0
"""What every hypothesis is judged on, and a fitted hypothesis."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from leo_diffmodel.compare.windows import Windows
from leo_diffmodel.explain.problem.hypothesis import Hypothesis
from leo_diffmodel.explain.problem.linearisation import Linearisation
from leo_sim.model import Model

Array = np.ndarray


@dataclass(frozen=True)
class Problem:
    """What every hypothesis is judged on.

    Attributes:
        base: the model as it stands.
        windows: the data, training and held-out.
        sigma: noise of each recording and channel (angles, then rates), shape (R, 2J).
        train: which windows a fit may see, shape (W,).
        linearisation: of a robot on the ground, the settled start states and what they do.
        block: stretch of time each window lies in, shape (W,): within one, errors are alike.
        fold: what is left out together when a prediction is judged, shape (W,).
        scale: times `sigma` by which residuals are weighed, shape (R, 2J): what a channel of a
            recording is off by with the best hypothesis, so that none shouts the others down.
        telling: windows of held-out recordings that tell what constants these have of their own,
            and are not judged, shape (W,); None where there are none.
    """

    base: Model
    windows: Windows
    sigma: Array
    train: Array
    linearisation: Linearisation | None = None
    block: Array | None = None
    fold: Array | None = None
    scale: Array | None = None
    telling: Array | None = None

    @property
    def judged(self) -> Array:
        """Which windows no fit may see, shape (W,)."""
        return ~self.train if self.telling is None else ~(self.train | self.telling)

    @property
    def trained(self) -> tuple[str, ...]:
        """Names of the recordings that a fit may see."""
        sources = np.unique(self.windows.source[self.train])
        return tuple(self.windows.recordings[s] for s in sources)

    @property
    def weight(self) -> Array:
        """What residuals are divided by, shape (R, 2J)."""
        return self.sigma if self.scale is None else self.sigma * self.scale

    @property
    def by_start(self) -> Array | None:
        """Sensitivity of the sensed states to the start states, where it is known."""
        return None if self.linearisation is None else self.linearisation.by_start

    def fixed(self, hypothesis: Hypothesis, theta: Array) -> Problem:
        """The problem with a hypothesis at some values in the model, nothing free."""
        model = hypothesis.model(self.base, theta) if len(theta) else self.base
        return replace(self, base=model)

    def take(self, index: Array) -> Problem:
        """The problem on some of its windows."""
        linearisation = self.linearisation and self.linearisation.take(index)
        block, fold, telling = (
            x if x is None else x[index] for x in (self.block, self.fold, self.telling)
        )
        return replace(self, windows=self.windows.take(index), train=self.train[index],
                       linearisation=linearisation, block=block, fold=fold,
                       telling=telling)  # fmt: skip


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
    """

    hypothesis: Hypothesis
    theta: Array
    covariance: Array
    start: Array
    loss: Array
    residual: Array
    columns: Array

    def take(self, index: Array) -> Fit:
        """The fit as it is on some of its windows."""
        return replace(self, start=self.start[index], loss=self.loss[index],
                       residual=self.residual[index], columns=self.columns[index])  # fmt: skip

    def reordered(self, order: Sequence[int]) -> Fit:
        """The fit with its effects in another order."""
        full = self.hypothesis
        first = [full.offset(i) for i in order]
        counts = [len(full.candidates[i].parameters) for i in order]
        own = [np.arange(f, f + n) for f, n in zip(first, counts, strict=True)]
        index = np.concatenate([*own, np.arange(sum(counts), full.size)]).astype(int)
        candidates = tuple(full.candidates[i] for i in order)
        return replace(self, hypothesis=replace(full, candidates=candidates),
                       theta=self.theta[index], covariance=self.covariance[np.ix_(index, index)],
                       columns=self.columns[..., index])  # fmt: skip

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
