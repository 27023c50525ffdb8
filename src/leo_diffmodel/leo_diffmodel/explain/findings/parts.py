# SPDX-License-Identifier: Apache-2.0
"""What each effect is worth beside the others, and what could stand in its place."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace

import numpy as np

from leo_diffmodel.compare import errors
from leo_diffmodel.compare.headline import Figures
from leo_diffmodel.compare.pushes import predict
from leo_diffmodel.explain.estimate.estimator import Estimate
from leo_diffmodel.explain.estimate.finish import completed
from leo_diffmodel.explain.estimate.fit import fit
from leo_diffmodel.explain.estimate.fitted import Fit
from leo_diffmodel.explain.findings.findings import Part, Rival
from leo_diffmodel.explain.findings.held_out import HeldOut
from leo_diffmodel.explain.problem.classes import Facts, same_thing
from leo_diffmodel.explain.problem.hypothesis import Candidate
from leo_diffmodel.explain.select.evidence import score, Scored
from leo_diffmodel.explain.select.search import Search
from leo_diffmodel.explain.select.sets import widens
from leo_diffmodel.explain.select.stable import share

Array = np.ndarray


def without(found: Search) -> list[Scored]:
    """The chosen hypothesis less each of its effects."""
    return [_less(found, c) for c in found.final.hypothesis.candidates]


def effects(found: Search, smaller: list[Scored], held: HeldOut, facts: Facts) -> Iterator[Part]:
    """The chosen effects, each beside the hypothesis without it."""
    after = _loss(found.chosen, held)
    for candidate, part in zip(found.final.hypothesis.candidates, smaller, strict=True):
        fits = part.fit, found.final
        yield _part(found, candidate, _loss(part, held) - after, fits, held, facts)


def singles(found: Search, held: HeldOut, facts: Facts) -> Iterator[Part]:
    """Every effect that was fitted alone, beside the model as given; best first."""
    empty = found.known(frozenset())
    assert empty is not None
    before = _loss(empty, held)
    for single in found.sets:
        if len(single.names) == 1:
            (candidate,) = single.names
            fits = found.null, single.fit
            yield _part(found, candidate, before - _loss(single, held), fits, held, facts)


def ladder(found: Search, held: HeldOut) -> Iterator[tuple[str, Figures]]:
    """Held-out errors of the model as given, and with each of the chosen effects added."""
    yield 'as given', held.figures(found.null)
    for count, candidate in enumerate(found.final.hypothesis.candidates, 1):
        yield f'+ {candidate.label}', held.figures(_up_to(found, count))


def floors(found: Search, smaller: list[Scored], held: HeldOut) -> tuple[float, ...]:
    """What each effect does in the windows of the search that no other one can [noise floors].

    Root mean square over windows and states at their end, of the prediction from the measured
    start less that of the other effects, refitted without it.
    """
    windows, sigma = found.problem.windows, found.problem.sigma
    made, start = errors.predict_windows(held.model(found.final), windows, sigma), windows.measured
    others = [predict(held.model(s.fit), windows, start[:, 0]) for s in smaller]
    return tuple(errors.change_at_end(made, states) for states in others)


def rivals(found: Search, candidate: Candidate, facts: Facts) -> Iterator[Rival]:
    """What else could stand in the place of an effect, nearest first; not a wider law of its kind.

    An effect that was not chosen is compared alone, on the model as given.
    """
    gates = found.weight.gates
    names = found.chosen.names if candidate in found.chosen.names else frozenset({candidate})
    mine = found.chosen if names == found.chosen.names else found.known(names)
    assert mine is not None
    for other in found.sets:
        if len(other.names) != len(names) or not names - {candidate} < other.names:
            continue
        (rival,) = other.names - (names - {candidate})
        behind = found.weight.ahead(mine, other)
        near = behind < gates.margin_nats
        if rival != candidate and not widens(rival, candidate) and abs(behind) < gates.told_nats:
            yield Rival(rival, behind, same_thing(candidate, rival, facts) if near else None)


def _part(
    found: Search,
    candidate: Candidate,
    saved: Array,
    fits: tuple[Fit, Fit],
    held: HeldOut,
    facts: Facts,
) -> Part:
    """An effect by the loss it saves in each window, (W,), and the fits without and with it."""
    trained, judged = (float(saved[w].sum()) for w in (found.problem.train, found.problem.judged))
    before, after = (held.figures(f) for f in fits)
    return Part(
        candidate,
        fits[1],
        (trained, judged),
        before,
        after,
        share(found.turns, [candidate], facts.alike),
        tuple(rivals(found, candidate, facts)),
    )


def _loss(scored: Scored, held: HeldOut) -> Array:
    """Of each window, held-out recordings with what they tell of themselves, (W,)."""
    return completed(scored.at.problem, scored.fit, held.own).loss


def _less(found: Search, candidate: Candidate) -> Scored:
    chosen = found.chosen
    if known := found.known(chosen.names - {candidate}):
        return known
    full = chosen.fit.hypothesis
    part = full.without(full.candidates.index(candidate))
    theta = part.carried(full, chosen.fit.theta)
    fitted = fit(chosen.at.problem, part, theta, chosen.fit.start)
    return score(Estimate(chosen.at.posed, fitted))


def _up_to(found: Search, count: int) -> Fit:
    """The first effects of the final set, refitted without the others."""
    full = found.final
    if count == len(full.hypothesis.candidates):
        return full
    part = replace(full.hypothesis, candidates=full.hypothesis.candidates[:count])
    theta = part.carried(full.hypothesis, full.theta)
    return fit(found.problem, part, theta, full.start)
