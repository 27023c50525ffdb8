# SPDX-License-Identifier: Apache-2.0
"""A fitted hypothesis: what it saves of another one, what it leaves, and its values as rows."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import asdict, dataclass, replace
import math
from typing import TYPE_CHECKING

import numpy as np

from leo_diffmodel.compare.windows import Array
from leo_diffmodel.explain.problem import likelihood
from leo_diffmodel.explain.problem.hypothesis import Candidate, Hypothesis
from leo_diffmodel.explain.settings import Gates

if TYPE_CHECKING:
    from leo_diffmodel.explain.problem.problem import Problem


@dataclass(frozen=True)
class Certificate:
    """How surely a fit rests at the least loss there is."""

    decrement: float  # what a full Gauss-Newton step still promises to save [nats]
    starts: int  # from how many values it was fitted
    reached: int  # how many of these ended at the least loss
    converged: bool  # whether that is enough to trust it

    def to_json(self) -> dict[str, float]:
        return asdict(self)


@dataclass(frozen=True)
class Fit:
    hypothesis: Hypothesis  # what was free
    theta: Array  # its parameters, shape (P,)
    # of theta, from the training windows, wider where more than noise is left, shape (P, P)
    covariance: Array
    # by how much they may be smaller and larger because a constant whose best value is a bound may
    # lie inside it; `ci95` adds this in quadrature, shape (P, 2)
    beyond: Array
    start: Array  # start states, shape (W, 2J)
    loss: Array  # robust cost of each window [nats], shape (W,)
    residual: Array  # whitened, start states projected out, shape (W, N)
    columns: Array  # its sensitivity to the parameters, shape (W, N, P)
    decrement: float = 0.0  # what a full Gauss-Newton step still promises to save [nats]
    # size of what it is off by in most windows [noise], (1, 2J), see `likelihood`
    typical: Array | None = None
    certificate: Certificate | None = None  # of one that was brought to its end
    # no step promised anything more; False where the iterations or the time were over, or it was
    # given up
    ended: bool = True
    # sensitivity of the whitened residual to the start states, shape (W, N, 2J); None where the
    # problem has it
    by_start: Array | None = None

    @property
    def point(self) -> tuple[Hypothesis, Array, Array]:
        return self.hypothesis, self.theta, self.start

    def lost(self, chosen: Array) -> float:
        return float(self.loss[chosen].sum())

    def take(self, index: Array) -> Fit:
        names = ('start', 'loss', 'residual', 'columns', 'by_start')
        parts = {name: part for name in names if (part := getattr(self, name)) is not None}
        return replace(self, **{name: part[index] for name, part in parts.items()})

    def reordered(self, order: Sequence[int]) -> Fit:
        full = self.hypothesis
        own = [np.arange(full.offset(i), full.offset(i + 1)) for i in order]
        index = np.concatenate([*own, np.arange(full.first_constant, full.size)]).astype(int)
        candidates = tuple(full.candidates[i] for i in order)
        return replace(
            self,
            hypothesis=replace(full, candidates=candidates),
            theta=self.theta[index],
            covariance=self.covariance[np.ix_(index, index)],
            beyond=self.beyond[index],
            columns=self.columns[..., index],
        )

    def own(self, candidate: Candidate) -> Array:
        index = self.hypothesis.candidates.index(candidate)
        return self.theta[self.hypothesis.offset(index) : self.hypothesis.offset(index + 1)]

    @property
    def saved(self) -> list[float]:
        """What each effect saves by its values and their covariance alone [nats]."""
        full, off, nats = self.hypothesis, self.theta - self.hypothesis.neutral, list[float]()
        for i, candidate in enumerate(full.candidates):
            own = full.offset(i) + np.flatnonzero([p.scales for p in candidate.parameters])
            inverse = np.linalg.pinv(self.covariance[np.ix_(own, own)])
            held = (off[own] != 0) & (self.standard_errors[own] == 0)
            nats.append(np.inf if held.any() else 0.5 * float(off[own] @ inverse @ off[own]))
        return nats

    def with_values(self, values: Array) -> Array:
        """Its parameters with `values` of further effects behind its own effects', (P + p,)."""
        split = self.hypothesis.first_constant
        return np.concatenate([self.theta[:split], values, self.theta[split:]])

    @property
    def standard_errors(self) -> Array:
        """Standard error of each parameter, shape (P,); 0 for one that lies on a bound."""
        return np.sqrt(np.maximum(np.diagonal(self.covariance), 0.0))

    def ci95(self, index: int) -> tuple[float, float]:
        """95 % confidence interval of parameter `index`, within its bounds."""
        half = 1.96 * float(self.standard_errors[index])
        below, above = self.beyond[index]
        low, high = self.hypothesis.low[index], self.hypothesis.high[index]
        value = float(self.theta[index])
        least, most = value - np.hypot(half, below), value + np.hypot(half, above)
        return max(float(least), float(low)), min(float(most), float(high))


def gain(null: Fit, other: Fit, chosen: Array, most: float = np.inf) -> float:
    """Robust loss [nats] that `other` saves on the chosen windows (W,), in each `most` at most."""
    return float(np.clip(null.loss - other.loss, -most, most)[chosen].sum())


def dispersion(fitted: Fit) -> float:
    """How many times the residual exceeds white noise."""
    return likelihood.dispersion(fitted.residual, fitted.start.shape[-1])


def unexplained(fitted: Fit, quantile: float = 0.5) -> float:
    """Mean squared whitened residual over its expected value: 1 where only noise is left.

    `quantile` is over windows; the median does not see what shows in less than half of them.
    """
    return likelihood.excess(fitted.residual, fitted.start.shape[-1], quantile)


def linear_part(problem: Problem, fitted: Fit, left_out: Iterable[Candidate]) -> Fit:
    """A fit without some effects by its linear answer: the others move, weights as they are."""
    full, out = fitted.hypothesis, {*left_out}
    part = Hypothesis(tuple(c for c in full.candidates if c not in out), full.constants)
    parameters = [(c, p) for c in full.candidates for p in c.parameters]
    gone = np.zeros(full.size, bool)
    gone[: len(parameters)] = [c in out for c, _ in parameters]
    scales = np.zeros(full.size, bool)
    scales[: len(parameters)] = [p.scales for _, p in parameters]
    move = np.where(gone & scales, full.neutral - fitted.theta, 0.0)
    free = ~gone & full.free(fitted.theta)
    move[free] = _answer(problem, fitted, move, free)
    theta = part.bounded((fitted.theta + move)[~gone])
    move[~gone] = theta - fitted.theta[~gone]
    residual = fitted.residual + fitted.columns @ move
    typical, channels = problem.typical_of(residual), fitted.start.shape[-1]
    kept, lost = np.ix_(~gone, ~gone), np.ix_(gone, gone)
    across = fitted.covariance[np.ix_(~gone, gone)]
    known = across @ np.linalg.pinv(fitted.covariance[lost]) @ across.T
    return replace(
        fitted,
        hypothesis=part,
        theta=theta,
        covariance=fitted.covariance[kept] - known,
        beyond=fitted.beyond[~gone],
        loss=likelihood.loss(residual, channels, problem.numerics, typical),
        residual=residual,
        columns=fitted.columns[..., ~gone],
        typical=typical,
        certificate=None,
    )


def _answer(problem: Problem, fitted: Fit, move: Array, free: Array) -> Array:
    """How far the free parameters follow when others move, shape (F,)."""
    channels, train = fitted.start.shape[-1], problem.train
    weight = likelihood.robust_weight(
        fitted.residual[train], channels, problem.numerics, fitted.typical
    )
    columns = (fitted.columns[train] * np.sqrt(weight)[..., None]).reshape(-1, len(move))
    moving = columns[:, free]
    size = np.maximum(np.sqrt((moving**2).sum(axis=0)), 1e-12)
    square = moving.T @ moving / np.outer(size, size) + 1e-9 * np.eye(len(size))
    return np.asarray(-np.linalg.solve(square, moving.T @ (columns @ move) / size) / size)


@dataclass(frozen=True)
class Rest:
    gates: Gates  # what counts
    ratio: float  # mean squared whitened residual over its expected value, see `rest_of`
    share: float  # of the model's error (beyond noise) that is left
    # by which correlation in time makes it less than it seems; 1 for white noise
    correlation: float = 1.0

    @property
    def matters(self) -> bool:
        gates, ratio = self.gates, self.ratio
        correlated = ratio > gates.correlated and self.correlation > gates.correlation
        much = ratio > gates.unexplained or correlated
        return ratio > gates.far or (self.share > gates.share and much)


def rest_of(problem: Problem, null: Fit, final: Fit) -> Rest:
    """What the effects of a fit leave of the error of the model without them (`null`).

    Looks at windows in which no contact comes or goes, if there are some: engines differ in
    impacts, and agree on what happens between two of them. On the ground the ratio is that of a
    window worse than most (`seen_at`), so that a law shows that acts at times only.
    """
    numerics = problem.numerics
    steady = np.flatnonzero(problem.steady(final.hypothesis, final.theta, final.start))
    if len(steady) >= problem.gates.fewest_windows:
        null, final = null.take(steady), final.take(steady)
    most = 1.0 - numerics.seen_windows / len(final.residual)
    quantile = max(0.5, min(numerics.seen_at, most))
    before, ratio = (unexplained(f, quantile) for f in (null, final))
    correlation = dispersion(final) / max(1.0, unexplained(final))
    share = float(np.clip((ratio - 1.0) / max(before - 1.0, 1e-9), 0.0, 1.0))
    return Rest(problem.gates, ratio, share, correlation)


def effect_row(fitted: Fit, index: int) -> dict:
    """Name, place, file and parameters of candidate `index`, as in explain.json."""
    candidate = fitted.hypothesis.candidates[index]
    row = {'name': candidate.effect.name, 'where': candidate.where}
    source = {'source': candidate.effect.source} if candidate.effect.source else {}
    return {**row, **source, 'parameters': parameter_rows(fitted, index)}


def parameter_rows(fitted: Fit, index: int) -> dict:
    first, candidate = fitted.hypothesis.offset(index), fitted.hypothesis.candidates[index]
    found = enumerate(candidate.parameters, first)
    return {p.name: _row(fitted, i, p.unit, turns=p.role == 'phase') for i, p in found}


def constant_rows(fitted: Fit) -> dict[str, dict]:
    """Value, unit and 95 % interval of each refitted constant, and in each recording, by path."""
    hypothesis, rows = fitted.hypothesis, dict[str, dict]()
    for i, c in enumerate(hypothesis.constants, hypothesis.first_constant):
        row = _row(fitted, i, c.unit)
        if c.recording:
            rows.setdefault(c.path, {'recordings': {}})['recordings'][c.recording] = row
        else:
            rows[c.path] = row
    return {path: _over_recordings(row) for path, row in rows.items()}


def _row(fitted: Fit, index: int, unit: str, turns: bool = False) -> dict:
    value, interval = float(fitted.theta[index]), fitted.ci95(index)
    whole = math.tau * round(value / math.tau) if turns else 0.0
    return {'value': value - whole, 'unit': unit, 'ci95': [end - whole for end in interval]}


def _over_recordings(row: dict) -> dict:
    if 'recordings' not in row:
        return row
    each = list(row['recordings'].values())
    low, high = zip(*(r['ci95'] for r in each), strict=True)
    mean = sum(r['value'] for r in each) / len(each)
    return {'value': mean, 'unit': each[0]['unit'], 'ci95': [min(low), max(high)], **row}


def intervals(fitted: Fit, index: int) -> dict[str, tuple[float, float]]:
    first, candidate = fitted.hypothesis.offset(index), fitted.hypothesis.candidates[index]
    return {p.name: fitted.ci95(i) for i, p in enumerate(candidate.parameters, first)}


def in_words(fitted: Fit, index: int) -> str:
    """The parameters of candidate `index` with units and intervals, as a sentence lists them."""
    rows = parameter_rows(fitted, index).items()
    return ', '.join(f'{name} = {_with_error(p)} {p["unit"]}'.rstrip() for name, p in rows)


def _with_error(parameter: dict) -> str:
    """A value with half its 95 % interval, to the digit that it allows, or with both its ends."""
    low, high = parameter['ci95']
    half = 0.5 * (high - low)
    if abs(0.5 * (low + high) - parameter['value']) > 0.1 * half:
        return f'{parameter["value"]:.3g} [{low:.3g} to {high:.3g}]'
    if not half > 0 or half > 10 * abs(parameter['value']):
        return f'{parameter["value"]:.3g}'
    digits = max(0, 1 - math.floor(math.log10(half)))
    if digits > 8:  # zeros that nobody counts
        figures = digits + 1 + math.floor(math.log10(max(abs(parameter['value']), half)))
        return f'{parameter["value"]:#.{figures}g} ± {half:#.2g}'
    return f'{parameter["value"]:.{digits}f} ± {half:.{digits}f}'
