# SPDX-License-Identifier: Apache-2.0
"""The smallest size of each effect that this data can show, and can name."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from leo_diffmodel.check.likeness import explained
from leo_diffmodel.check.traces import Trace, Traces
from leo_diffmodel.explain.problem.classes import Facts, same_thing
from leo_diffmodel.explain.select.sets import widens
from leo_diffmodel.explain.settings import SETTINGS

Array = np.ndarray
POWER_SIGMAS = 1.645
FARTHEST = 15.0
"""An effect linear in its size is followed up to so many times the size that was tried."""
LEAST_SHARE = 1e-3
"""Data a thousand times as long are no advice."""


@dataclass(frozen=True)
class Reach:
    """What the data can say about one effect at one place.

    Attributes:
        name, where: the effect and its place.
        unit: of the amplitudes, which are changes from neutral.
        detectable: smallest amplitude that is found in 95 % of runs; None where none is.
        nameable: smallest amplitude that is told from every other effect as well.
        nearest: the effect that it is hardest to tell from, and nats between the two when it
            has its typical size.
        typical: a small but common size, to compare data sets by.
        typical_nats: evidence of that size.
        seconds_to_detect, seconds_to_name: data like these that the typical size needs [s].
        together: effects that are the same thing in any data of this kind.
    """

    name: str
    where: str
    unit: str
    detectable: float | None
    nameable: float | None
    nearest: tuple[str, float]
    typical: float
    typical_nats: float
    seconds_to_detect: float | None
    seconds_to_name: float | None
    together: tuple[str, ...]

    @property
    def label(self) -> str:
        """effect:where."""
        return f'{self.name}:{self.where}'


def needed(nats: float | Array) -> Array:
    """Evidence at which a gain of `nats` is passed in 95 % of runs; 0 where any will do.

    A gain of mean m has the variance 2 m.
    """
    half = POWER_SIGMAS / np.sqrt(2)
    under = half**2 + np.asarray(nats, dtype=float)
    return np.where(under > 0, (half + np.sqrt(np.maximum(under, 0.0))) ** 2, 0.0)


@dataclass(frozen=True)
class Apart:
    """How far apart every two effects are; row i has its typical size, column j explains it.

    Attributes:
        nats: evidence of i that j cannot reproduce, shape (effects, effects).
        ahead: nats by which i is cheaper than j, having fewer parameters.
        same: whether both are the same thing in any data of this kind.
    """

    nats: Array
    ahead: Array
    same: Array

    @cached_property
    def separable(self) -> Array:
        """By how much i beats j where i is the truth [nats]."""
        return self.nats + self.ahead

    @cached_property
    def longer(self) -> Array:
        """How many times as much data tells i from j in 95 % of runs; 0 where any does."""
        with np.errstate(divide='ignore', invalid='ignore'):
            least = needed(SETTINGS.gates.margin_nats - self.ahead)
            return np.nan_to_num(least / self.nats, nan=0.0)


def reaches(data: Traces, facts: Facts) -> tuple[list[Reach], Apart]:
    """One row per effect and place, and how far every two of them are apart.

    Args:
        data: traces of all effects.
        facts: what decides which effects are the same thing.
    """
    traces, alike = data.traces, explained(data.traces)
    ends = np.cumsum([len(t.sizes) for t in traces])
    rest = [
        t.nats[:, None] * (1 - alike[e - len(t.sizes) : e])
        for t, e in zip(traces, ends, strict=True)
    ]
    cost = data.price * np.array([len(t.candidate.parameters) for t in traces])
    apart = Apart(
        np.array([_at_typical(t, r) for t, r in zip(traces, rest, strict=True)]),
        cost - cost[:, None],
        np.array(
            [
                [a is not b and bool(same_thing(a.candidate, b.candidate, facts)) for b in traces]
                for a in traces
            ]
        ),
    )
    return [_reach(data, i, r, apart) for i, r in enumerate(rest)], apart


def _reach(data: Traces, i: int, rest: Array, apart: Apart) -> Reach:
    trace, labels = data.traces[i], [t.candidate.label for t in data.traces]
    rivals = [
        j
        for j, other in enumerate(data.traces)
        if j != i and not apart.same[i, j] and not widens(other.candidate, trace.candidate)
    ]
    found = trace.nats / needed(data.threshold)
    with np.errstate(divide='ignore', invalid='ignore'):
        told = rest / needed(SETTINGS.gates.margin_nats - apart.ahead[i])
    both = np.minimum(found, np.nan_to_num(told[:, rivals], nan=np.inf).min(axis=1))
    nearest = min(rivals, key=lambda j: apart.separable[i, j])
    candidate = trace.candidate
    return Reach(
        name=candidate.effect.name,
        where=candidate.where,
        unit=candidate.parameters[0].unit,
        detectable=_smallest(trace, found),
        nameable=_smallest(trace, both),
        nearest=(labels[nearest], float(apart.separable[i, nearest])),
        typical=typical(trace),
        typical_nats=float(_at_typical(trace, trace.nats)),
        seconds_to_detect=_seconds(data, float(_at_typical(trace, found))),
        seconds_to_name=_seconds(data, float(_at_typical(trace, both))),
        together=tuple(labels[j] for j in np.flatnonzero(apart.same[i])),
    )


def _seconds(data: Traces, share: float) -> float | None:
    return data.seconds / share if share > LEAST_SHARE else None


def typical(trace: Trace) -> float:
    """The second smallest size that was tried, or the only one."""
    sizes = np.unique(trace.sizes)
    return float(sizes[min(1, len(sizes) - 1)])


def _at_typical(trace: Trace, values: Array) -> Array:
    """The median of values (S, ...) over signs and shapes at the typical size."""
    return np.asarray(np.median(values[np.isclose(trace.sizes, typical(trace))], axis=0))


def _smallest(trace: Trace, ratio: Array) -> float | None:
    """The size at which `ratio` reaches 1 for half of the signs and shapes an effect can have."""
    sizes = np.unique(trace.sizes)
    usual = np.array([np.median(ratio[np.isclose(trace.sizes, s)]) for s in sizes])
    good = np.flatnonzero(usual >= 1)
    if not good.size:
        grown = np.sqrt(1 / max(usual[-1], 1e-12))
        limit = FARTHEST if len(sizes) == 1 else 1.0
        return float(sizes[-1] * grown) if grown <= limit else None
    first = int(good[0])
    if first == 0:
        return float(sizes[0] / np.sqrt(usual[0]))
    low, high = np.log(np.maximum(usual[first - 1 : first + 1], 1e-9))
    share = -low / max(high - low, 1e-9)
    return float(np.exp((1 - share) * np.log(sizes[first - 1]) + share * np.log(sizes[first])))
