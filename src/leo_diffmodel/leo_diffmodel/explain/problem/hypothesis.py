# SPDX-License-Identifier: Apache-2.0
"""A hypothesis: a set of effects that may be missing, and the constants refitted with them."""

from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np

from leo_diffmodel.compare.windows import Array
from leo_sim.description.robot import Constant
from leo_sim.effects import Effect, Parameter, place, Placed
from leo_sim.model import Model

EVERYWHERE = 'all'


@dataclass(frozen=True)
class Candidate:
    """One effect at one place: a joint, a link, or `EVERYWHERE` for one shared value.

    Its parameters have this robot's units, neutral values and bounds.
    """

    effect: Effect
    where: str
    parameters: tuple[Parameter, ...]

    @property
    def label(self) -> str:
        return f'{self.effect.name}:{self.where}'

    @property
    def has_whole(self) -> bool:
        """Whether a parameter is a whole number, which a scan chooses and no fit moves."""
        return any(p.whole for p in self.parameters)


@dataclass(frozen=True)
class Hypothesis:
    """Candidates and uncertain constants, their values in one parameter vector.

    The vector holds each candidate's parameters in the order declared, then the constants. Of a
    constant that differs between recordings there is one for each of them.
    """

    candidates: tuple[Candidate, ...] = ()
    constants: tuple[Constant, ...] = ()

    @property
    def size(self) -> int:
        return self.first_constant + len(self.constants)

    @property
    def first_constant(self) -> int:
        return self.offset(len(self.candidates))

    @property
    def low(self) -> Array:
        return np.array([p.low for p in self._parameters] + [c[0] for c in self._ranges])

    @property
    def high(self) -> Array:
        return np.array([p.high for p in self._parameters] + [c[1] for c in self._ranges])

    @property
    def neutral(self) -> Array:
        return np.array([p.neutral for p in self._parameters] + [c.value for c in self.constants])

    @property
    def whole(self) -> Array:
        """Which parameters are whole numbers: a scan chooses them, and no fit moves them."""
        return np.array([p.whole for p in self._parameters] + [False] * len(self.constants), bool)

    @property
    def turns(self) -> Array:
        """Which parameters are angles or places at which a law has its place, shape (P,)."""
        return np.array([p.turns for p in self._parameters] + [False] * len(self.constants), bool)

    @property
    def recordings(self) -> tuple[str, ...]:
        """The recording whose own each parameter is; '' for one that all share."""
        return (*[''] * self.first_constant, *(c.recording for c in self.constants))

    @property
    def own(self) -> Array:
        """Which parameters are a recording's own, shape (P,)."""
        return np.array([name != '' for name in self.recordings], bool)

    @property
    def together(self) -> list[list[int]]:
        """Numbers of the parameters but whole ones, in groups of which no window sees two.

        A group holds the values that one constant has in several recordings.
        """
        first, recordings = self.first_constant, self.recordings
        rows: dict[str | int, list[int]] = {}
        for i in map(int, np.flatnonzero(~self.whole)):
            key = self.constants[i - first].path if recordings[i] else i
            rows.setdefault(key, []).append(i)
        return list(rows.values())

    def free(self, theta: Array) -> Array:
        """Which parameters a small step may move either way: on none of their bounds."""
        return (theta > self.low) & (theta < self.high) & ~self.whole

    def prior(self, theta: Array) -> Array:
        """Precision of each parameter before any data, (P,); inf for what is held fast.

        Of an effect 0. A constant is uniform between its bounds; its variance is about its value.
        """
        first = self.first_constant
        at, low, high = theta[first:], self.low[first:], self.high[first:]
        width = np.where(high > low, high - low, np.inf)
        known = 3 * width / ((at - low) ** 3 + (high - at) ** 3)
        return np.where(self.free(theta), np.concatenate([np.zeros(first), known]), np.inf)

    def room(self, theta: Array) -> Array:
        """Signed distance from the bound that a constant is on to its other one, (P,); else 0."""
        first = self.first_constant
        at, low, high = theta[first:], self.low[first:], self.high[first:]
        way = 1.0 * (at <= low) - (at >= high)
        return np.concatenate([np.zeros(first), way * (high - low)])

    def least(self, theta: Array) -> Array:
        """Lower bound of each parameter where the others have these values, shape (P,)."""
        least = self.low
        for index, candidate in enumerate(self.candidates):
            first, values = self.offset(index), self.values(theta, index)
            for i, p in enumerate(candidate.parameters):
                if p.above:
                    least[first + i] = max(least[first + i], values[p.above])
        return least

    def bounded(self, theta: Array) -> Array:
        inside = np.clip(theta, self.low, self.high)
        return np.maximum(inside, self.least(inside))

    def moved(self, theta: Array, step: Array) -> Array:
        """The values after a step, within the bounds.

        Where the law is straight in the product of two of them, so is the step: it would else
        lead nowhere while both are far off.
        """
        there = self.bounded(theta + step)
        for index, candidate in enumerate(self.candidates):
            first, names = self.offset(index), [p.name for p in candidate.parameters]
            for i, p in enumerate(candidate.parameters, first):
                if not p.times:
                    continue
                by = first + names.index(p.times)
                product = theta[i] * theta[by] + step[i] * theta[by] + theta[i] * step[by]
                there[i] = product / there[by] if there[by] != 0 else there[i]
        return self.bounded(there)

    def with_candidate(self, candidate: Candidate) -> 'Hypothesis':
        return Hypothesis((*self.candidates, candidate), self.constants)

    def without(self, index: int) -> 'Hypothesis':
        rest = self.candidates[:index] + self.candidates[index + 1 :]
        return Hypothesis(rest, self.constants)

    def carried(self, other: 'Hypothesis', theta: Array) -> Array:
        """The vector of this hypothesis with the values of another one that holds all of it."""
        held = [other.candidates.index(c) for c in self.candidates]
        own = [theta[other.offset(i) : other.offset(i + 1)] for i in held]
        return np.concatenate([*own, theta[len(theta) - len(self.constants) :]])

    def offset(self, index: int) -> int:
        return sum(len(c.parameters) for c in self.candidates[:index])

    def values(self, theta: Array, index: int) -> dict[str, float]:
        first = self.offset(index)
        names = [p.name for p in self.candidates[index].parameters]
        return {n: float(v) for n, v in zip(names, theta[first:], strict=False)}

    def placed(self, base: Model, theta: Array) -> tuple[Placed, ...]:
        """The candidates as effects with values; `theta` is (P,) or (S, P)."""
        return tuple(self._placed(base, theta, i) for i in range(len(self.candidates)))

    def model(self, base: Model, theta: Array) -> Model:
        """`base` with these effects and constants; `theta` (S, P) makes S models at once."""
        if not self.size:
            return base
        shared, own = dict(base.constants), {p: dict(v) for p, v in base.by_recording.items()}
        for i, c in enumerate(self.constants, self.first_constant):
            values = own.setdefault(c.path, {}) if c.recording else shared
            values[c.recording or c.path] = _lead(theta[..., i])
        return base.changed(
            effects=(*base.effects, *self.placed(base, theta)), constants=shared, by_recording=own
        )

    def _placed(self, base: Model, theta: Array, index: int) -> Placed:
        candidate, first = self.candidates[index], self.offset(index)
        values = {p.name: _lead(theta[..., first + i]) for i, p in enumerate(candidate.parameters)}
        for p in candidate.parameters:
            if p.above:
                values[p.name] = np.maximum(values[p.name], values[p.above])
        return place(base.robot, candidate.effect, candidate.where, **values)

    @property
    def _parameters(self) -> list[Parameter]:
        return [p for c in self.candidates for p in c.parameters]

    @property
    def _ranges(self) -> list[tuple[float, float]]:
        return [c.uncertain or (c.value, c.value) for c in self.constants]


def _lead(value: Array) -> float | Array:
    """Scalars as floats; one value a model as (S, 1, 1), to broadcast over windows and joints."""
    return float(value) if np.ndim(value) == 0 else value[:, None, None]


def amplitude_indices(parameters: tuple[Parameter, ...]) -> tuple[int, ...]:
    return tuple(i for i, p in enumerate(parameters) if p.scales)


def compatible(names: Iterable[Candidate], other: Candidate) -> bool:
    """Whether an effect may stand with others: not what shares a term with one at its place."""

    def overlaps(one: Candidate) -> bool:
        everywhere = EVERYWHERE in (one.where, other.where)
        return one.where == other.where or (everywhere and one.effect.hook == other.effect.hook)

    return not any(overlaps(c) and _terms(c) & _terms(other) for c in names)


def _terms(candidate: Candidate) -> set[Parameter]:
    return {p for p in candidate.parameters if p.scales}


def widens(candidate: Candidate, other: Candidate) -> bool:
    """Whether an effect is a wider law than another at its place, and no second cause."""
    return candidate.where == other.where and set(other.parameters) < set(candidate.parameters)
