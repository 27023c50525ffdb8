# SPDX-License-Identifier: Apache-2.0
"""All effects in one linear problem about a fit, so that any set is judged without a rollout."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
from scipy.optimize import lsq_linear

from leo_diffmodel.compare.windows import Array
from leo_diffmodel.explain.estimate import trials
from leo_diffmodel.explain.estimate.estimator import Progress, SCAN
from leo_diffmodel.explain.estimate.fitted import Fit
from leo_diffmodel.explain.estimate.scan import Scan, Scanner
from leo_diffmodel.explain.estimate.terms import Column, MASS, MOMENT, Term, terms_of
from leo_diffmodel.explain.problem.hypothesis import Candidate, Hypothesis
from leo_diffmodel.explain.problem.problem import Problem
from leo_diffmodel.explain.problem.sizes import Scales
from leo_diffmodel.explain.settings import Settings

Tried = tuple[list[Term], list[Array], list[Scan]]
"""Terms of a candidate, the best first, their columns (C, M), and its scan if it does a thing."""


@dataclass(frozen=True)
class Matrices:
    """Terms, and the normal equations of all their columns, scaled to unit length."""

    fit: Fit  # what they are linear about
    members: tuple[Term, ...]  # terms of the effects in it
    others: tuple[Term, ...]  # of all other effects, the shapes of each that explain most
    gram: Array  # products of the columns, shape (C, C)
    along: Array  # their products with what no effect explains, shape (C,)
    total: float  # half the square of that [nats]
    limits: Array  # of the coefficients, shape (2, C)
    length: Array  # of the columns before, shape (C,)
    scans: tuple[Scan, ...]  # of the candidates that are not in the fit, on top of it, most first
    threshold: float  # gain that noise alone can give [nats]
    samples: int  # how many the columns have
    masses: Mapping[str, float]  # of the links in the fit [kg]

    @property
    def terms(self) -> tuple[Term, ...]:
        return (*self.members, *self.others)

    def least(self, terms: Sequence[Term]) -> tuple[float, Array]:
        """Loss of a set [nats] and its coefficients within their limits, term by term."""
        index = indices(terms)
        if not index:
            return self.total, np.zeros(0)
        root = np.linalg.cholesky(square(self.gram, index)).T
        target = np.linalg.solve(root.T, self.along[index])
        low, high = self.limits[:, index]
        best = lsq_linear(root, target, (low, np.maximum(high, low + 1e-8)), 'bvls').x
        rest = root @ best - target
        return self.total - 0.5 * float(target @ target - rest @ rest), best

    def gains(self, held: Sequence[Term], groups: Sequence[Sequence[Term]]) -> list[float]:
        """What each group of further terms saves beside those that are held [nats]."""
        index = indices(held)
        right = np.c_[self.gram[index], self.along[index]]
        across = np.linalg.solve(square(self.gram, index), right)
        left = self.along - self.gram[:, index] @ across[:, -1]
        free = self.gram - self.gram[:, index] @ across[:, :-1]
        spans = [indices(group) for group in groups]
        return [0.5 * float(left[s] @ np.linalg.solve(square(free, s), left[s])) for s in spans]

    def alike(self, held: Sequence[Term], term: Term) -> float:
        """The largest cosine of a column of a term with what some others can do together."""
        index = indices(held)
        across = self.gram[np.ix_(index, [*term.span])]
        shares = (across * np.linalg.solve(square(self.gram, index), across)).sum(axis=0)
        return float(np.sqrt(np.clip(shares, 0.0, 1.0)).max(initial=0.0))

    def hypothesis(self, terms: Sequence[Term]) -> tuple[Hypothesis, Array]:
        """A set as a hypothesis, and its values (P,)."""
        best, full = iter(self.least(terms)[1]), self.fit.hypothesis
        values = {
            t.candidate: t.values([next(best) / self.length[i] for i in t.span]) for t in terms
        }
        for candidate in values:
            if candidate.effect.name == MOMENT:
                values[candidate] = values[candidate] * self._lighter(candidate.where, values)
        made = Hypothesis(tuple(values), full.constants)
        constants = self.fit.theta[full.first_constant :]
        return made, made.bounded(np.concatenate([*values.values(), constants]))

    def _lighter(self, link: str, values: Mapping[Candidate, Array]) -> float:
        """The mass of a link in the fit, as a share of that in a set: its moment is linear."""
        held = self.fit.hypothesis.candidates
        was = {c.where: float(self.fit.own(c)[0]) for c in held if c.effect.name == MASS}
        now = {c.where: float(v[0]) for c, v in values.items() if c.effect.name == MASS}
        more = now.get(link, 0.0) - was.get(link, 0.0)
        return self.masses[link] / max(self.masses[link] + more, 0.05 * self.masses[link])


def matrices(
    problem: Problem,
    fitted: Fit,
    scales: Scales,
    pool: Sequence[Candidate],
    progress: Progress = lambda *_: None,
) -> Matrices:
    """Linearise a fit in its own effects and, at finite amplitudes, in all those of a pool.

    In some of the training windows; start states and constants are projected out.
    """
    few = max(1, round(problem.numerics.matrix_samples / problem.windows.steps))
    some = problem.some_trained(few)
    made = _Builder(problem.take(some), fitted.take(some), scales)
    progress('effects one by one', 0)
    held = fitted.hypothesis.candidates
    able = [c for c in pool if c not in held or c.has_whole]
    found = trials.spread_until(
        problem.until, made.tried, able, lambda c: progress(c.label, 1, SCAN)
    )
    for number, shown in found.items():
        made.add(able[number], shown)
    return made.made


class _Builder:
    def __init__(self, problem: Problem, fitted: Fit, scales: Scales):
        self._problem, self._fit = problem, fitted
        self._scanner = Scanner(problem, fitted, scales)
        full = fitted.hypothesis
        moved = self._scanner.without_starts(np.moveaxis(-fitted.columns, -1, 0))
        free = [i for i in range(full.first_constant, full.size) if full.free(fitted.theta)[i]]
        self._constants = _basis(moved[free])
        self._rows: list[Array] = []
        self._target = self._free(self._scanner.first)
        self._members = [self._member(n, self._free(moved)) for n in range(len(full.candidates))]
        self._others: list[Term] = []
        self._scans: list[Scan] = []
        self._held = _basis(np.array(self._rows).reshape(-1, len(self._target)))
        self._left = self._beside(self._target)

    def _free(self, rows: Array) -> Array:
        return rows - (rows @ self._constants.T) @ self._constants

    def _beside(self, rows: Array) -> Array:
        """Rows (..., M) without what the effects of the fit explain."""
        return rows - (rows @ self._held.T) @ self._held

    def _member(self, number: int, moved: Array) -> Term:
        """An effect of the fit; the target becomes what is left without it."""
        full, theta = self._fit.hypothesis, self._fit.theta
        candidate, offset = full.candidates[number], full.offset(number)
        begin = theta[offset : full.offset(number + 1)].copy()
        columns, first = [], len(self._rows)
        for i, p in enumerate(candidate.parameters):
            row = moved[offset + i]
            if p.whole or not row @ row > 1e-6:
                continue
            if p.scales:
                self._target = self._target + (begin[i] - p.neutral) * row
                begin[i] = p.neutral
            direction = np.eye(len(begin))[i]
            columns.append(Column(direction, p.low - begin[i], p.high - begin[i]))
            self._rows.append(row)
        return Term(candidate, begin, tuple(columns), first)

    def tried(self, candidate: Candidate) -> Tried:
        """What a candidate does, whatever the others do."""
        terms = list(terms_of(candidate, self._scanner))
        rows = self._rows_of(candidate, terms)
        gains = [self._gain(term, r) for term, r in zip(terms, rows, strict=True)]
        order = sorted(range(len(terms)), key=lambda n: -gains[n][0])
        shown = [n for n in order if (rows[n] ** 2).sum() > 1e-6]
        few = shown[: self._problem.numerics.pair_points]
        scans = []
        if shown:
            gain, best = gains[shown[0]]
            traces = [0.5 * float((self._beside(rows[n]) ** 2).sum(axis=-1).max()) for n in shown]
            values = self._fit.with_values(terms[shown[0]].values(best))
            first = self._fit.hypothesis.first_constant
            scans = [Scan(candidate, values, gain, max(traces), first)]
        return [terms[n] for n in few], [rows[n] for n in few], scans

    def add(self, candidate: Candidate, tried: Tried) -> None:
        terms, rows, scans = tried  # of another process' copy of the candidate
        for term, own in zip(terms, rows, strict=True):
            self._others.append(replace(term, candidate=candidate, first=len(self._rows)))
            self._rows += [*own]
        self._scans += [replace(scan, candidate=candidate) for scan in scans]

    def _rows_of(self, candidate: Candidate, terms: Sequence[Term]) -> list[Array]:
        points = [term.begin + c.direction for term in terms for c in term.columns]
        rows = self._free(self._scanner.change(candidate, np.array(points)))
        rows = np.where(np.isfinite(rows), rows, 0.0)
        parts = np.split(rows, np.cumsum([len(term.columns) for term in terms])[:-1])
        less = [np.array([[c.beside] for c in term.columns]) for term in terms]
        return [part - of * part[0] for part, of in zip(parts, less, strict=True)]

    def _gain(self, term: Term, rows: Array) -> tuple[float, Array]:
        """What a term saves beside the effects of the fit, and its coefficients."""
        beside = self._beside(rows)
        square = beside @ beside.T + 1e-6 * np.eye(len(rows))
        along = beside @ self._left
        low, high = np.array([(c.low, c.high) for c in term.columns]).T
        best = np.clip(np.linalg.solve(square, along), low, high)
        return float(best @ along - 0.5 * best @ square @ best), best

    @property
    def made(self) -> Matrices:
        rows = np.array(self._rows).reshape(-1, len(self._target))
        length = np.sqrt((rows**2).sum(axis=1)) + 1e-6
        terms = [*self._members, *self._others]
        limits = np.array([(c.low, c.high) for t in terms for c in t.columns]).reshape(-1, 2)
        rows = rows / length[:, None]
        gram, fitted = rows @ rows.T, self._fit
        bodies = fitted.hypothesis.model(self._problem.base, fitted.theta).laws.bodies
        return Matrices(
            fitted,
            tuple(self._members),
            tuple(self._others),
            gram,
            rows @ self._target,
            0.5 * float(self._target @ self._target),
            limits.T * length,
            length,
            tuple(sorted(self._scans, key=lambda s: -s.gain)),
            _threshold(gram, indices(self._members), self._problem.settings),
            len(self._target),
            {name: float(body.mass) for name, body in bodies.items()},
        )


def indices(terms: Sequence[Term]) -> list[int]:
    return [i for term in terms for i in term.span]


def square(gram: Array, index: Sequence[int]) -> Array:
    """Of unit columns, with a ridge that two which do the same share."""
    return np.asarray(gram[np.ix_(index, index)] + 1e-8 * np.eye(len(index)))


def _basis(rows: Array) -> Array:
    """Rows of unit length across each other, of the same span."""
    return np.linalg.qr(rows.T)[0].T


def _threshold(gram: Array, held: Sequence[int], settings: Settings) -> float:
    """As `scan.threshold`, beside columns that are held, from the products of columns alone."""
    gates = settings.gates
    free = gram - gram[:, held] @ np.linalg.solve(square(gram, held), gram[held])
    size = np.diag(free)
    others = [i for i in range(len(gram)) if i not in {*held} and size[i] > 1e-8]
    if not others:
        return gates.least_nats
    unit = free[np.ix_(others, others)] / np.sqrt(np.outer(size[others], size[others]))
    values, vectors = np.linalg.eigh(unit)
    draws = np.random.default_rng(0).standard_normal((settings.numerics.draws, len(others)))
    root = vectors * np.sqrt(np.maximum(values, 0.0)) @ vectors.T  # no sign of a vector matters
    along = draws @ root
    best = 0.5 * np.square(np.maximum(along, 0.0).max(axis=1))
    noise = gates.noise_times * float(np.quantile(best, gates.noise_quantile))
    return max(gates.least_nats, noise)
