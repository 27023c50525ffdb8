# SPDX-License-Identifier: Apache-2.0
"""The start states of a robot on the ground that fit best, and the sensitivity to them.

The sensitivity is expensive with contact: a foot bends it, so it is found again until the start
states settle. It belongs to a hypothesis at some values; what is fitted from there moves the
parameters, and the start states with them, along it. Without contact see `settle`.
"""

from dataclasses import replace

import numpy as np

from leo_diffmodel.compare.pushes import predict, tame, whitened
from leo_diffmodel.compare.windows import Array, per_window, Windows
from leo_diffmodel.explain.problem import likelihood
from leo_diffmodel.explain.problem.problem import Linearisation, Problem
from leo_diffmodel.explain.problem.shooting import sensitivities, whiten

COARSE, FINER = 'search', 'training'


def settled(
    problem: Problem, before: Linearisation | None = None, relinearise: bool = False
) -> tuple[Array, Linearisation]:
    """Which windows can be trusted, as indices, and their linearisation with the model as it is.

    A window is trusted where the start states that its noise allows do not change what its
    contacts do: there the linearisation holds. `before`: the one with another model, to go on
    from; its windows are all kept. `relinearise`: find the sensitivity of all windows again, not
    only where it was far off.
    """
    active = np.arange(problem.windows.count)
    at = _Settling(problem, before)
    if relinearise:
        at.linearise(active)
    for round_ in range(problem.numerics.rounds):
        going = at.step(active)
        if before and not round_:  # their sensitivity may be too old to have led anywhere
            going |= at.worse(before).all(axis=0)
        active = active[going]
        if not active.size:
            break
        at.linearise(active)
    if before:
        after = replace(before, start=at.start, by_start=at.columns, loss=at.loss)
        return np.arange(problem.windows.count), after
    kept = _sure(problem, at.start, at.columns)
    nothing = np.zeros_like(problem.windows.measured[kept])
    return kept, Linearisation(at.start[kept], at.columns[kept], at.loss[kept], nothing)


class _Settling:
    """Windows on the way to the start states that fit them best; see `Linearisation`."""

    def __init__(self, problem: Problem, before: Linearisation | None):
        self._numerics, self._noise = problem.numerics, problem.noise
        model, windows = problem.base, problem.windows
        self._model, self._windows = model, windows
        if before:
            self.start, self.columns = before.start.copy(), before.by_start.copy()
            self._predicted = predict(model, windows, before.start)
            self.loss = self._lost(windows, self._predicted)
            bad = np.flatnonzero(self.worse(before).any(axis=0))
            if bad.size:  # start them where they were measured, those that are better for it
                self._try(bad, windows.measured[bad, 0], self._predicted[bad])
        else:
            self.start = windows.measured[:, 0].copy()
            self._predicted, self.columns = sensitivities(model, windows, self.start)
            self.columns[~tame(self.columns)] = 0.0
            self.loss = self._lost(windows, self._predicted)

    def worse(self, before: Linearisation) -> Array:
        """Windows that are far worse than most, and those that are worse than before, (2, W)."""
        far = self.loss > self._numerics.released * np.median(self.loss)
        return np.stack([far, self.loss > before.loss + self._numerics.follow_nats])

    def step(self, active: Array) -> Array:
        """Move starts where that is better; which are to be linearised again.

        These gained much, and what their linearisation was off by limits what another step gains.
        """
        part, loss, numerics = self._windows.take(active), self.loss[active], self._numerics
        before, columns = self._predicted[active], self.columns[active]
        step = self._robust_step(part, before, columns)
        change = np.einsum('wkij,wj->wki', columns, step)
        promised, surprise = self._lost(part, before + change), np.zeros(len(active))
        waiting = np.flatnonzero(promised < loss - numerics.worth_nats)
        for scale in numerics.strides:
            if waiting.size:
                expected = (before + scale * change)[waiting]
                moved = self.start[active[waiting]] + scale * step[waiting]
                better, surprise[waiting] = self._try(active[waiting], moved, expected)
                waiting = waiting[~better]
        enough = numerics.follow_nats
        return np.asarray((self.loss[active] < loss - enough) & (surprise > enough))

    def _robust_step(self, windows: Windows, predicted: Array, columns: Array) -> Array:
        noise, numerics = per_window(self._noise, windows), self._numerics
        e, white = whitened(windows.measured - predicted, columns, noise)
        root = np.sqrt(likelihood.robust_weight(e, predicted.shape[-1], numerics))[..., None]
        a = root * white
        inverse = _inverse(a, numerics.least_damping)
        return (inverse @ (np.swapaxes(a, -1, -2) @ (root * e[..., None])))[..., 0]

    def _lost(self, part: Windows, predicted: Array) -> Array:
        e = whiten(part, predicted, self._noise, self._numerics.farthest)
        return likelihood.loss(e, predicted.shape[-1], self._numerics)

    def _try(self, some: Array, start: Array, expected: Array) -> tuple[Array, Array]:
        """Take the starts that are better; which are, and how far off was expected [nats]."""
        part = self._windows.take(some)
        predicted = predict(self._model, part, start)
        loss = self._lost(part, predicted)
        better: Array = loss < self.loss[some]
        taken = some[better]
        self.start[taken], self._predicted[taken] = start[better], predicted[better]
        self.loss[taken] = loss[better]
        return better, self._lost(part, part.measured + expected - predicted)

    def linearise(self, active: Array) -> None:
        part = self._windows.take(active)
        predicted, columns = sensitivities(self._model, part, self.start[active])
        sane = tame(columns)
        self._predicted[active[sane]], self.columns[active[sane]] = predicted[sane], columns[sane]


def refined(problem: Problem, linearisation: Linearisation) -> tuple[Problem, Linearisation]:
    """The windows less what a finer integration than the coarsest adds, from the settled starts.

    What a coarse one is off by hardly depends on the parameters, so this brings the fit with the
    coarse one to where the finer one has its best.
    """
    model, windows = problem.base, problem.windows
    if model.scheme != COARSE:
        return problem, linearisation
    fine = predict(model.changed(scheme=FINER), windows, linearisation.start)
    finer = fine - predict(model, windows, linearisation.start)
    q, dq = np.split(windows.measured + linearisation.finer - finer, 2, axis=-1)
    finely = replace(problem, windows=replace(windows, q=q, dq=dq))
    return finely, replace(linearisation, finer=finer)


def _inverse(a: Array, damping: float) -> Array:
    """Covariance of the start states, (W, 2J, 2J); directions that do not show stay put."""
    gram = np.swapaxes(a, -1, -2) @ a
    size = np.sqrt(np.diagonal(gram, axis1=-2, axis2=-1)) + 1e-12
    scaled = gram / (size[..., None] * size[:, None])
    inverse = np.linalg.inv(scaled + damping * np.eye(a.shape[-1]))
    return inverse / (size[..., None] * size[:, None])


def _sure(problem: Problem, start: Array, columns: Array) -> Array:
    """Indices of the windows whose predictions are linear within the noise of their start."""
    windows, numerics = problem.windows, problem.numerics
    noise = per_window(problem.noise, windows)
    a = (columns / noise[..., None]).reshape(windows.count, -1, columns.shape[-1])
    values, vectors = np.linalg.eigh(_inverse(a, numerics.least_damping))
    root = vectors * np.sqrt(np.maximum(values, 0.0))[:, None]
    shape = numerics.start_draws, *start.shape, 1
    draws = np.random.default_rng(0).standard_normal(shape)
    moves = (root @ draws)[..., 0]
    y = predict(problem.base, windows, np.concatenate([start[None], start + moves]))
    linear = np.einsum('wkij,swj->swki', columns, moves)
    bend = (((y[1:] - y[0] - linear) / noise) ** 2).mean(axis=(0, 2, 3))
    sure, fewest = np.flatnonzero(bend < numerics.most_bend), problem.gates.fewest_windows
    return sure if sure.size >= fewest else np.argsort(bend)[:fewest]
