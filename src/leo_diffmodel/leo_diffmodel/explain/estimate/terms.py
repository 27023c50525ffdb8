# SPDX-License-Identifier: Apache-2.0
"""The columns of each effect: what its parameters are moved by in one linear problem."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
import itertools

import numpy as np

from leo_diffmodel.compare.windows import Array
from leo_diffmodel.explain.estimate.scan import Scanner, stretch_limits
from leo_diffmodel.explain.problem.hypothesis import amplitude_indices, Candidate

MASS, MOMENT = 'link_mass', 'link_com'


@dataclass(frozen=True)
class Column:
    """What the parameters of an effect do, moved in one direction (P,).

    Its coefficient is between `low` and `high`. Some are what that does `beside` the first column
    of an effect: of a mass at another place its first moment.
    """

    direction: Array
    low: float
    high: float
    beside: bool = False


@dataclass(frozen=True, eq=False)
class Term:
    """One effect in one shape: its columns are in a set all together, or not at all."""

    candidate: Candidate  # the effect and its place
    begin: Array  # its parameters where all coefficients are 0, shape (P,)
    # what its parameters do; two a quarter turn apart for a sine of any phase
    columns: tuple[Column, ...]
    first: int = 0  # number of its first column among those of all
    phase: int | None = None  # number of the parameter that is its phase, if it has one

    @property
    def span(self) -> range:
        return range(self.first, self.first + len(self.columns))

    @property
    def fixed(self) -> tuple[float, ...]:
        """Its values of what a fit does not move, or hardly: whole numbers and shapes."""
        pairs = zip(self.candidate.parameters, self.begin, strict=True)
        return tuple(float(value) for p, value in pairs if p.whole or p.role == 'shape')

    def values(self, coefficients: Sequence[float] | Array) -> Array:
        if self.phase is not None:
            by, turned = float(np.hypot(*coefficients)), float(np.arctan2(*coefficients[::-1]))
            values = self.begin + by * self.columns[0].direction
            values[self.phase] = turned
            return np.asarray(values)
        by = max(coefficients[0], 1e-9) if self.columns else 1.0
        moves = (
            x / by * (c.direction - self.columns[0].direction) if c.beside else x * c.direction
            for x, c in zip(coefficients, self.columns, strict=True)
        )
        return np.asarray(sum(moves, self.begin))


def terms_of(candidate: Candidate, scanner: Scanner) -> Iterator[Term]:
    """The shapes of an effect: what is straight in its amplitudes once, else each size."""
    parameters, amplitude = candidate.parameters, amplitude_indices(candidate.parameters)
    if candidate.effect.hook == 'body' and any(p.times for p in parameters):
        yield from _at_places(candidate, scanner)
        return
    others = [
        (0.0,) if p.role == 'phase' else scanner.shape(candidate, p)
        for p in parameters
        if not p.scales
    ]
    phase = next((i for i, p in enumerate(parameters) if p.role == 'phase'), None)
    straight = all(parameters[i].role == 'amplitude' for i in amplitude)
    columns: list[Column] = []
    for shape in itertools.product(*others):
        rest = iter(shape)
        begin = np.array([p.neutral if p.scales else next(rest) for p in parameters])
        if straight:
            columns = columns or [_straight(candidate, begin, i, scanner) for i in amplitude]
            both = columns if phase is None else [*_quarters(columns[0], phase)]
            yield Term(candidate, begin, tuple(both), phase=phase)
        else:
            for size in scanner.sizes(candidate, parameters[amplitude[0]]):
                direction = size * np.eye(len(begin))[amplitude[0]]
                limits = stretch_limits(candidate, scanner.grids)
                yield Term(candidate, begin, (Column(direction, *limits),))


def _at_places(candidate: Candidate, scanner: Scanner) -> Iterator[Term]:
    """A mass at the centre of a link, or as far beyond it, and its first moments about there.

    Of one that is there from some time on, at several times.
    """
    parameters = candidate.parameters
    centre = dict(zip('xyz', scanner.centre(candidate.where), strict=True))
    late = candidate.effect.onset
    onsets = scanner.onsets(scanner.grids.onsets) if late else (0.0,)
    for far, onset in itertools.product(scanner.grids.places, onsets):
        also = {p.name: far * centre[p.name] if p.times else onset for p in parameters[1:]}
        begin = np.array([also.get(p.name, p.neutral) for p in parameters])
        mass = _straight(candidate, begin, 0, scanner)
        others = [
            Column(mass.direction + scanner.sizes(candidate, p)[1] * unit, -np.inf, np.inf, True)
            for p, unit in zip(parameters, np.eye(len(begin)), strict=True)
            if p.times
        ]
        yield Term(candidate, begin, (mass, *others))


def _quarters(column: Column, phase: int) -> Iterator[Column]:
    """Sine and cosine of an amplitude, of any sign."""
    far = max(abs(column.low), abs(column.high))
    for turned in (0.0, 0.5 * np.pi):
        direction = column.direction + turned * np.eye(len(column.direction))[phase]
        yield Column(direction, -far, far)


def _straight(candidate: Candidate, begin: Array, i: int, scanner: Scanner) -> Column:
    """One amplitude, and those that are never less; as far as predictions answer in proportion."""
    parameters, p = candidate.parameters, candidate.parameters[i]
    moved = np.array([float(k == i or q.above == p.name) for k, q in enumerate(parameters)])
    size = scanner.small(candidate, begin, moved, scanner.sizes(candidate, p)[1])
    if p.high < p.neutral + size:
        size = -size
    far = scanner.grids.heavier if candidate.effect.name == MOMENT else 1.0
    low, high = sorted(far * (end - p.neutral) / size for end in (p.low, p.high))
    return Column(size * moved, low, high)
