# SPDX-License-Identifier: Apache-2.0
"""What stays of a choice where folds are left out, effect by effect.

Stability selection (Meinshausen and Bühlmann 2010) asks of each effect how often it is chosen. It
is there by any name, in a wider law, or in a law of all joints. Where a wider law is not chosen in
enough of the turns and a narrower one in it is, the narrower one is the answer.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence

import numpy as np

from leo_diffmodel.explain.problem.hypothesis import Candidate, Hypothesis
from leo_diffmodel.explain.select.evidence import Scored
from leo_diffmodel.explain.select.sets import Names, Sets, supported, widens

Alike = Callable[[Candidate, Candidate], bool]
"""Whether two effects are one, or the same thing in the data."""
EVERYWHERE = 'all'


def part_of(candidate: Candidate, other: Candidate) -> bool:
    """Whether an effect is in another: a law of one joint in that of all, or in a wider one."""
    there = candidate.where == other.where or other.where == EVERYWHERE
    mine, its = _laws_of(candidate), _laws_of(other)
    return (
        there
        and candidate.effect.hook == other.effect.hook
        and (candidate.effect.name == other.effect.name or mine < its)
    )


def _laws_of(candidate: Candidate) -> set[tuple[str, str]]:
    """Its parameters; their bounds may differ from joint to joint."""
    return {(p.name, p.unit) for p in candidate.parameters}


def holds(names: Iterable[Candidate], candidate: Candidate, alike: Alike) -> bool:
    """Whether a set has an effect, the same thing by another name, or something that contains it.

    Two effects may do what one does for all joints.
    """
    return any(alike(c, candidate) or part_of(candidate, c) for c in names)


def share(turns: Sequence[Names], candidates: Iterable[Candidate], alike: Alike) -> float:
    """Share of the turns that hold all of some effects."""
    wanted = list(candidates)
    return float(np.mean([all(holds(names, c, alike) for c in wanted) for names in turns]))


def narrowed(found: Sets, best: Scored, turns: Sequence[Names], alike: Alike) -> Scored:
    """The chosen set, wider laws given way to narrower ones where only those stay.

    Args:
        found: the finished search.
        best: the chosen set.
        turns: what is chosen where folds are left out, one set for each draw.
        alike: whether two effects are one.
    """
    names = frozenset(_narrowed(found, c, turns, alike) for c in best.names)
    if names == best.names:
        return best
    narrow = _fitted(found, best, names)
    known = list(found.known.values())
    return narrow if supported(known, narrow, found.weight, found.threshold) else best


def _narrowed(
    found: Sets, candidate: Candidate, turns: Sequence[Names], alike: Alike
) -> Candidate:
    """The effect, or the widest law in it that enough of the turns hold where they do not it."""
    narrower = [c for c in found.pool if widens(candidate, c)]
    laws = [candidate, *sorted(narrower, key=lambda c: -len(c.parameters))]
    stays = (c for c in laws if share(turns, [c], alike) >= found.settings.gates.stable)
    return next(stays, candidate)


def _fitted(found: Sets, best: Scored, names: Names) -> Scored:
    """A set, fitted with all its parts from the values of the chosen one."""
    if names not in found.known:
        full, theta = best.fit.hypothesis, best.fit.theta
        core = Hypothesis(tuple(c for c in found.pool if c in names), full.constants)
        values = [v for c in core.candidates for v in _values(full, theta, c)]
        start = np.array([*values, *theta[len(theta) - len(core.constants) :]])
        found.add([found.estimator.refitted(best.at, core, start)])
    found.add_parts(found.known[names])
    return found.known[names]


def _values(full: Hypothesis, theta: np.ndarray, candidate: Candidate) -> list[float]:
    """Values of an effect in a fit that has it, or a wider law of it."""
    index = next(
        i for i, c in enumerate(full.candidates) if c == candidate or widens(c, candidate)
    )
    values = full.values(theta, index)
    return [values[p.name] for p in candidate.parameters]
