# SPDX-License-Identifier: Apache-2.0
"""What every hypothesis is judged on."""

from dataclasses import dataclass, replace
import time
from typing import Any

import numpy as np

from leo_diffmodel.compare.pushes import own, predict
from leo_diffmodel.compare.windows import Array, evenly, per_window, Windows
from leo_diffmodel.explain.problem.hypothesis import Hypothesis
from leo_diffmodel.explain.problem.likelihood import typical_size
from leo_diffmodel.explain.problem.shooting import Linear, linearise, whiten
from leo_diffmodel.explain.settings import Gates, Grids, Numerics, Settings
from leo_sim.dynamics.whole_windows import Along
from leo_sim.model import Model


@dataclass(frozen=True)
class Linearisation:
    """The windows of one hypothesis, linearised about the start states that fit them best."""

    start: Array  # start states that fit them best, shape (W, 2J)
    by_start: Array  # sensitivity of the sensed states to them, shape (W, K+1, 2J, 2J)
    loss: Array  # what is left of each window there [nats], shape (W,)
    # what a finer integration would add to the predictions, shape (W, K+1, 2J); it is taken off
    # the measurements of the settled windows
    finer: Array

    def take(self, index: Array) -> 'Linearisation':
        return Linearisation(*(part[index] for part in vars(self).values()))


@dataclass(frozen=True)
class Problem:
    base: Model  # the model as it stands, the counts of servos left out, see `pose.uncounted`
    windows: Windows  # the data, training and held-out
    sigma: Array  # noise of each recording and channel (angles, then rates), shape (R, 2J)
    train: Array  # which windows a fit may see, shape (W,)
    settings: Settings  # every number by which it is answered
    # of a robot on the ground, the settled start states and what they do
    linearisation: Linearisation | None = None
    # stretch of time each window lies in, shape (W,): within one, errors are alike
    block: Array | None = None
    fold: Array | None = None  # what is left out together when a prediction is judged, shape (W,)
    # windows of held-out recordings that the constants these have of their own are fitted to, and
    # that are not judged, shape (W,); None where there are none
    telling: Array | None = None
    # size of what a hypothesis is off by in most windows [noise], (1, 2J), see `likelihood.loss`;
    # None before one was fitted
    typical: Array | None = None
    # integration step with which sensitivities are found [s]; None is the model's
    rough_step: float | None = None
    until: float = np.inf  # when its fits end wherever they are [s of `time.monotonic`]
    # noise that the measured inputs add to each sample of a window, (R, K+1, 2J), see
    # `noise.of_inputs`; None where they are exact
    drift: Array | None = None
    # what was not measured in each recording but differentiated, shape (R, 2J); None where all
    # was. It says nothing that the angles do not, and is smoother than the robot
    unseen: Array | None = None

    def late(self) -> bool:
        return time.monotonic() > self.until

    @property
    def gates(self) -> Gates:
        return self.settings.gates

    @property
    def numerics(self) -> Numerics:
        return self.settings.numerics

    @property
    def grids(self) -> Grids:
        return self.settings.grids

    @property
    def on_ground(self) -> bool:
        """Whether contacts decide what start states do, so that its windows were settled."""
        return self.linearisation is not None

    @property
    def judged(self) -> Array:
        """Which windows no fit may see, shape (W,)."""
        return ~self.train if self.telling is None else ~(self.train | self.telling)

    def some_trained(self, most: int) -> Array:
        """Numbers of `most` training windows, evenly chosen; of all where there are no more."""
        train = np.flatnonzero(self.train)
        return train[evenly(len(train), most)]

    @property
    def trained(self) -> tuple[str, ...]:
        sources = np.unique(self.windows.source[self.train])
        return tuple(self.windows.recordings[s] for s in sources)

    @property
    def noise(self) -> Array:
        """`sigma` and `drift`, infinite where nothing was measured, shape (R, [K+1,] 2J)."""
        sigma, unseen = self.sigma, self.unseen
        if self.drift is not None:
            sigma = np.hypot(sigma[:, None], self.drift)
            unseen = unseen if unseen is None else unseen[:, None]
        return sigma if unseen is None else np.where(unseen, np.inf, sigma)

    @property
    def by_start(self) -> Array | None:
        """Sensitivity of the whitened residual to the start states where known, (W, N, 2J)."""
        if self.linearisation is None:
            return None
        by_start, noise = self.linearisation.by_start, per_window(self.noise, self.windows)
        return -(by_start / noise[..., None]).reshape(len(by_start), -1, by_start.shape[-1])

    def typical_of(self, residual: Array) -> Array | None:
        """Typical size (1, 2J) of whitened training residuals (W, N); None where not shared."""
        if not self.numerics.shared:
            return None
        return typical_size(residual[self.train], 2 * self.windows.q.shape[-1], self.numerics)

    @property
    def first(self) -> Array:
        """Where start states begin at first, (W, 2J)."""
        return self.linearisation.start if self.linearisation else self.windows.measured[:, 0]

    def begins(self, start: Array) -> tuple[Array, ...]:
        """Where start states may begin, each (W, 2J): where they were, and where measured.

        A joint that friction holds does not answer to its start, which may be caught there. On
        the ground a measured start may be a leap out of it.
        """
        return (start,) if self.on_ground else (start, self.windows.measured[:, 0])

    @property
    def rough(self) -> Model:
        """The model as sensitivities are found with it, integrated as coarsely as that allows."""
        return self.roughly.base

    @property
    def roughly(self) -> 'Problem':
        """The problem integrated so; itself where that is the step of the model."""
        if self.rough_step in (None, self.base.integration_step):
            return self
        model = self.base.changed(integration_step=self.rough_step)
        return replace(self, base=model, rough_step=None)

    def linearised(
        self,
        hypothesis: Hypothesis,
        theta: Array,
        start: Array,
        errors: Array | None = None,
        by_start: Array | None = None,
    ) -> Linear:
        """The windows linearised about a hypothesis at theta (P,) and start states (W, 2J).

        `errors` are standard errors of each parameter with the others fixed, (P,), where known;
        `by_start` the known sensitivity of the residual to the start states, (W, N, 2J), by
        default what contacts were settled with.
        """
        known = self.by_start if by_start is None else by_start
        return linearise(self, hypothesis, theta, start, known, errors)

    def residual(
        self, start: Array, model: Model | None = None, near: bool | Along = False
    ) -> Array:
        """Whitened residual (..., W, N) from start states (..., W, 2J), `near` as in `rollout`."""
        predicted = predict(model or self.base, self.windows, start, near=near)
        return whiten(self.windows, predicted, self.noise, self.numerics.farthest)

    def fixed(self, hypothesis: Hypothesis, theta: Array) -> 'Problem':
        """The problem with a hypothesis at some values in the model, nothing free."""
        return replace(self, base=hypothesis.model(self.base, theta))

    def steady(self, hypothesis: Hypothesis, theta: Array, start: Array) -> Array:
        """Windows in which no contact with the ground comes or goes, from start states (W, 2J).

        All of them where there is no ground.
        """
        if not self.base.robot.contacts:
            return np.ones(self.windows.count, dtype=bool)
        fixed = self.fixed(hypothesis, theta).base
        measured = np.split(predict(fixed, self.windows, start), 2, axis=-1)
        model = own(fixed, self.windows, instants=True)
        touching = model.spheres.forces(*model.laws.true_state(*measured)) > 0
        unchanged: Array = (touching == touching[:, :1]).all(axis=(1, 2))
        return unchanged

    def take(self, index: Array) -> 'Problem':
        optional = {name: getattr(self, name) for name in ('block', 'fold', 'telling')}
        taken: dict[str, Any] = {n: x[index] for n, x in optional.items() if x is not None}
        linear = self.linearisation and self.linearisation.take(index)
        taken |= {'windows': self.windows.take(index), 'train': self.train[index]}
        return replace(self, linearisation=linear, **taken)
