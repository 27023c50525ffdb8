# SPDX-License-Identifier: Apache-2.0
"""The smallest size of each effect that this data can show, and can name."""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from leo_diffmodel.check.settings import CHECK
from leo_diffmodel.check.traces import Trace, Traces
from leo_diffmodel.compare.windows import Array
from leo_diffmodel.explain.problem.classes import Facts, same_thing
from leo_diffmodel.explain.problem.hypothesis import widens
from leo_diffmodel.explain.settings import SETTINGS


@dataclass(frozen=True)
class Reach:
    name: str  # the effect and its place
    where: str
    unit: str  # of the amplitudes, which are changes from neutral
    detectable: float | None
    """Smallest amplitude that is found in 95 % of runs; None where none is."""
    nameable: float | None
    """Smallest amplitude at which every other effect fits clearly worse as well."""
    nearest: tuple[str, float]
    """The effect that is most like it, and nats between the two when it has its typical size."""
    typical: float  # a small but common size, to compare data sets by
    typical_nats: float  # evidence of that size
    seconds_to_detect: float | None  # data like these that the typical size needs [s]
    seconds_to_name: float | None
    together: tuple[str, ...]  # effects that are the same thing in any data of this kind

    @property
    def label(self) -> str:
        return f'{self.name}:{self.where}'


def needed(nats: float | Array) -> Array:
    """Evidence at which a gain (mean m, variance 2 m) passes `nats` in 95 % of runs; 0 for any."""
    half = CHECK.power_sigmas / np.sqrt(2)
    under = half**2 + np.asarray(nats, dtype=float)
    return np.where(under > 0, (half + np.sqrt(np.maximum(under, 0.0))) ** 2, 0.0)


@dataclass(frozen=True)
class Apart:
    """How far apart every two effects are; row i has its typical size, column j explains it."""

    nats: Array  # evidence of i that j cannot reproduce, shape (effects, effects)
    ahead: Array  # nats by which i is cheaper than j, having fewer parameters
    same: Array  # whether both are the same thing in any data of this kind

    @cached_property
    def separable(self) -> Array:
        """By how much i beats j where i is the truth [nats]."""
        return self.nats + self.ahead

    @cached_property
    def longer(self) -> Array:
        """How many times as much data separates i from j in 95 % of runs; 0 where any does."""
        with np.errstate(divide='ignore', invalid='ignore'):
            least = needed(SETTINGS.gates.margin_nats - self.ahead)
            return np.nan_to_num(least / self.nats, nan=0.0)


def reaches(data: Traces, facts: Facts) -> tuple[list[Reach], Apart]:
    """One row per effect and place, and how far every two of them are apart.

    `facts` decide which effects are the same thing.
    """
    traces, alike = data.traces, explained(data.traces)
    parts = np.split(alike, np.cumsum([len(t.sizes) for t in traces])[:-1])
    rest = [t.nats[:, None] * (1 - part) for t, part in zip(traces, parts, strict=True)]
    of = [t.candidate for t in traces]
    cost = data.price * np.array([len(c.parameters) for c in of])
    same = [[a is not b and bool(same_thing(a, b, facts)) for b in of] for a in of]
    nats = [_at_typical(t, r) for t, r in zip(traces, rest, strict=True)]
    apart = Apart(np.array(nats), cost - cost[:, None], np.array(same))
    return [_reach(data, i, r, apart) for i, r in enumerate(rest)], apart


def _reach(data: Traces, i: int, rest: Array, apart: Apart) -> Reach:
    trace, of, same = data.traces[i], [t.candidate for t in data.traces], apart.same[i]
    rivals = [j for j, c in enumerate(of) if j != i and not same[j] and not widens(c, of[i])]
    found = trace.nats / needed(data.threshold)
    with np.errstate(divide='ignore', invalid='ignore'):
        separate = rest / needed(SETTINGS.gates.margin_nats - apart.ahead[i])
    both = np.minimum(found, np.nan_to_num(separate[:, rivals], nan=np.inf).min(axis=1))
    nearest = min(rivals, key=lambda j: apart.separable[i, j])
    return Reach(
        name=of[i].effect.name,
        where=of[i].where,
        unit=of[i].parameters[0].unit,
        detectable=_smallest(trace, found),
        nameable=_smallest(trace, both),
        nearest=(of[nearest].label, float(apart.separable[i, nearest])),
        typical=typical(trace),
        typical_nats=float(_at_typical(trace, trace.nats)),
        seconds_to_detect=_seconds(data, float(_at_typical(trace, found))),
        seconds_to_name=_seconds(data, float(_at_typical(trace, both))),
        together=tuple(of[j].label for j in np.flatnonzero(same)),
    )


def _seconds(data: Traces, share: float) -> float | None:
    return data.seconds / share if share > CHECK.least_share else None


def typical(trace: Trace) -> float:
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
        limit = CHECK.farthest if len(sizes) == 1 else 1.0
        return float(sizes[-1] * grown) if grown <= limit else None
    first = int(good[0])
    if first == 0:
        return float(sizes[0] / np.sqrt(usual[0]))
    low, high = np.log(np.maximum(usual[first - 1 : first + 1], 1e-9))
    share = -low / max(high - low, 1e-9)
    return float(np.exp((1 - share) * np.log(sizes[first - 1]) + share * np.log(sizes[first])))


def explained(traces: Sequence[Trace]) -> Array:
    """Share of each trace's evidence that another effect reproduces (cos^2), (points, traces).

    The other effect may take any size and sign that was tried, or any mix of the parameters that
    scale it. An effect explains all of itself (docs/reference/identification.md 1.5).
    """
    stacked = np.concatenate([t.signatures for t in traces])
    cosines, last = stacked @ stacked.T, np.cumsum([len(t.sizes) for t in traces])
    own = [slice(e - len(t.sizes), e) for t, e in zip(traces, last, strict=True)]
    columns = [_by(cosines[:, rows], rows, t) for t, rows in zip(traces, own, strict=True)]
    return np.clip(np.stack(columns, axis=1), 0.0, 1.0)


def _by(cosine: Array, own: slice, trace: Trace) -> Array:
    """Share (N,) of each signature that a trace reproduces, of their cosines (N, S)."""
    best = np.maximum(cosine, 0.0).max(axis=1) ** 2
    mixed = sum(p.scales for p in trace.candidate.parameters)
    if mixed < 2:
        return np.asarray(best)
    square, turned = np.linalg.eigh(cosine[own])
    kept = np.flatnonzero(square > CHECK.likeness_least * square[-1])[-mixed:]
    along = cosine @ (turned[:, kept] / np.sqrt(square[kept]))
    return np.maximum(best, (along**2).sum(axis=1))
