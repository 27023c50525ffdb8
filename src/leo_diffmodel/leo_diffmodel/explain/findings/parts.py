# SPDX-License-Identifier: Apache-2.0
"""Each effect: its worth, what could replace it, what recordings ask of it, where it shows."""

from collections.abc import Iterator, Sequence

import numpy as np
from scipy.special import stdtrit

from leo_diffmodel.compare import errors
from leo_diffmodel.compare.conditions import carried, folded
from leo_diffmodel.compare.headline import Figures
from leo_diffmodel.compare.pushes import predict
from leo_diffmodel.compare.sizes import length_unit, torque_unit
from leo_diffmodel.compare.windows import Array, Windows
from leo_diffmodel.explain.estimate.fitted import Fit
from leo_diffmodel.explain.findings.findings import Part, Range, RecordingValue, Rival, Shown
from leo_diffmodel.explain.findings.held_out import HeldOut
from leo_diffmodel.explain.findings.last_fits import Finished
from leo_diffmodel.explain.problem import likelihood
from leo_diffmodel.explain.problem.candidates import at_limit
from leo_diffmodel.explain.problem.classes import Facts, same_thing
from leo_diffmodel.explain.problem.hypothesis import amplitude_indices, Candidate, widens
from leo_diffmodel.explain.problem.problem import Problem
from leo_diffmodel.explain.select.evidence import Scored
from leo_diffmodel.explain.select.search import Search
from leo_diffmodel.explain.select.sets import Names
from leo_diffmodel.explain.select.stable import share
from leo_sim.model import Model


def effects(done: Finished, facts: Facts) -> Iterator[Part]:
    """The chosen effects, each compared with the hypothesis without it."""
    found, after = done.search, _loss(done.search.chosen, done.held)
    for candidate, part in zip(found.final.hypothesis.candidates, done.smaller, strict=True):
        saved = _loss(part, done.held) - after
        yield _part(done, candidate, saved, (part.fit, found.final), facts)


def singles(done: Finished, facts: Facts) -> Iterator[Part]:
    """Every effect that was fitted alone, compared with the model as given; best first."""
    found, empty = done.search, done.search.known(frozenset())
    assert empty is not None
    before = _loss(empty, done.held)
    for single in (s for s in found.sets if len(s.names) == 1):
        (candidate,) = single.names
        saved = before - _loss(single, done.held)
        yield _part(done, candidate, saved, (found.null, single.fit), facts)


def ladder(done: Finished) -> Iterator[tuple[str, Figures]]:
    """Held-out errors of the model as given, and with each of the chosen effects added."""
    found, held = done.search, done.held
    yield 'as given', held.figures(found.null)
    for candidate, fitted in zip(found.final.hypothesis.candidates, done.growing, strict=True):
        yield f'+ {candidate.label}', held.figures(fitted)


def floors(done: Finished) -> tuple[float, ...]:
    """What each effect does in the windows of the search that no other one can [noise floors].

    Root mean square over windows and states at their end, of the prediction from the measured
    start less that of the other effects, refitted without it.
    """
    held, problem = done.held, done.search.problem
    windows, final = problem.windows, held.model(done.search.final)
    made, start = errors.predict_windows(final, windows, problem.sigma), windows.measured[:, 0]
    others = [predict(held.model(s.fit), windows, start) for s in done.smaller]
    return tuple(errors.change_at_end(made, states) for states in others)


def rivals(found: Search, candidate: Candidate, facts: Facts) -> Iterator[Rival]:
    """What else could stand in the place of an effect, nearest first; not a wider law of its kind.

    The other effects may have other names for the same thing. An effect that was not chosen is
    compared alone, on the model as given.
    """
    gates, holder = found.weight.gates, found.chosen
    if candidate not in holder.names:
        alone = found.known(frozenset({candidate}))
        assert alone is not None
        holder = alone
    told = {candidate}
    for other in found.sets:
        rival = _in_place_of(candidate, holder.names, other.names, facts)
        behind = found.weight.ahead(holder, other)
        if rival is None or rival in told or abs(behind) >= gates.told_nats:
            continue
        told.add(rival)
        if not widens(rival, candidate) and not _far_away(rival, other.fit):
            near = behind < gates.margin_nats
            same = same_thing(candidate, rival, facts) if near else None
            yield Rival(rival, other.fit, behind, same)


def _far_away(candidate: Candidate, fitted: Fit) -> bool:
    """Whether an effect acts from as far away as it may be: a constant one under another name."""
    own = zip(candidate.parameters, fitted.own(candidate), strict=True)
    return any(p.role == 'position' and at_limit(p, v, v) for p, v in own)


def _in_place_of(effect: Candidate, names: Names, other: Names, facts: Facts) -> Candidate | None:
    """What another set of as many effects has for this one; None where more differs."""
    if len(other) != len(names):
        return None
    rest = names - {effect}
    less, more = rest - other, other - rest
    left = [c for c in more if not any(facts.alike(c, d) for d in less)]
    able = all(any(facts.alike(c, d) for c in more) for d in less)
    return left[0] if able and len(left) == 1 else None


def _part(
    done: Finished, candidate: Candidate, saved: Array, fits: tuple[Fit, Fit], facts: Facts
) -> Part:
    """An effect by the loss it saves in each window, (W,), and the fits without and with it."""
    found, problem = done.search, done.search.problem
    trained, judged = (float(saved[w].sum()) for w in (problem.train, problem.judged))
    before, after = (done.held.figures(f) for f in fits)
    kept = share(found.resamples, [candidate], facts.alike)
    others = tuple(rivals(found, candidate, facts))
    without, whole = fits
    return Part(candidate, whole, without, (trained, judged), before, after, kept, others)


def _loss(scored: Scored, held: HeldOut) -> Array:
    """Of each window, with the constants that held-out recordings have of their own, (W,)."""
    return held.completed(scored.fit, scored.at.problem).loss


def values_by_recording(
    problem: Problem, final: Fit, bags: Sequence[str]
) -> tuple[dict[int, list[RecordingValue]], ...]:
    """For each effect, by its parameters that scale it, the values that recordings ask for."""
    hypothesis = final.hypothesis
    scaling = (
        [hypothesis.offset(n) + i for i in amplitude_indices(c.parameters)]
        for n, c in enumerate(hypothesis.candidates)
    )
    return tuple(
        {i: list(_by_recording(problem, final, bags, i)) for i in places} for places in scaling
    )


def _by_recording(
    problem: Problem, final: Fit, bags: Sequence[str], index: int
) -> Iterator[RecordingValue]:
    """The values of parameter `index`, all else as it is.

    One Newton step from the joint fit; the interval is that of a sandwich over the blocks of the
    recording, with Student's t.
    """
    assert problem.block is not None
    column, channels = final.columns[..., index], final.start.shape[-1]
    weight = likelihood.robust_weight(final.residual, channels, problem.numerics, final.typical)
    slopes = (weight * column * final.residual).sum(axis=-1)
    curvature = (weight * column**2).sum(axis=-1)
    for number, bag in enumerate(bags):
        of_bag = problem.windows.source == number
        blocks, where = np.unique(problem.block[of_bag], return_inverse=True)
        whole = float(curvature[of_bag].sum())
        if len(blocks) < problem.gates.fewest_blocks or not whole > 0:
            continue
        value = float(final.theta[index] - slopes[of_bag].sum() / whole)
        spread = float(np.sqrt((np.bincount(where, slopes[of_bag]) ** 2).sum())) / whole
        yield RecordingValue(bag, value, spread * float(stdtrit(len(blocks) - 1, 0.975)))


def shown_for(
    windows: Windows, model: Model, candidates: Sequence[Candidate], facts: Facts
) -> tuple[Shown, ...]:
    """Where each joint at which named effects act was, by the windows of all recordings.

    The load is the torque that the gear transmits, the motor's less gravity's, of which
    load-dependent friction is a share: its mean over a window. `model` has the effects.
    """
    load, robot = carried(windows, model), model.robot
    places, shown = {p for c in candidates for p in _joints(c, facts)}, []
    for j, name in enumerate(robot.joint_names):
        if name in places:
            unit = length_unit(robot, name)
            angle = _range(folded(windows.q[..., j]), unit)
            speed = _range(windows.dq[..., j], f'{unit}/s')
            shown.append(Shown(name, angle, speed, _range(load[:, j], torque_unit(robot, name))))
    return tuple(shown)


def _joints(candidate: Candidate, facts: Facts) -> list[str]:
    """The joints at which an effect acts: of a link the one that moves it; none of the ground."""
    moved_by = {j.child: j.leader or j.name for j in facts.robot.joints}
    alone = candidate.where != 'all'
    places = [candidate.where] if alone else candidate.effect.places(facts.robot)
    return [moved_by.get(facts.body(place), place) for place in places]


def _range(values: Array, unit: str) -> Range:
    low, high = np.percentile(values, (1, 99))
    return Range(float(low), float(high), unit)
