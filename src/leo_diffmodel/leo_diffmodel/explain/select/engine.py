# SPDX-License-Identifier: Apache-2.0
"""The search from recordings to a supported set of effects; no words, no files."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np

from leo_diffmodel.bags.recording import Recording
from leo_diffmodel.compare import noise
from leo_diffmodel.compare.sizes import inertia_scale, mass_scale, torque_scale
from leo_diffmodel.compare.windows import Windows
from leo_diffmodel.explain.estimate.fit import Fit, fit, Problem
from leo_diffmodel.explain.estimate.hypothesis import Candidate, Hypothesis
from leo_diffmodel.explain.estimate.on_ground import polished
from leo_diffmodel.explain.estimate.scan import Scales
from leo_diffmodel.explain.problem.candidates import candidates
from leo_diffmodel.explain.problem.pose import pose, Posed, standing
from leo_diffmodel.explain.select.ranking import Round
from leo_diffmodel.explain.select.review import Explore, review, Reviewed
from leo_diffmodel.explain.select.scored import unexplained, WHOLE
from leo_diffmodel.explain.select.search import explore
from leo_sim.effects import Effect
from leo_sim.model import Model
from leo_sim.robot import Constant

if TYPE_CHECKING:
    from leo_diffmodel.explain.unknown.find import Found

Array = np.ndarray
MOST_EFFECTS = 5
MOST_REVIEWS = 3
SEVERAL = 3
"""Effects that leave something, for which one law is tried before a further one is. Two may be a
wrong name for a pair at one joint, which a law imitates; a third would mend that."""


@dataclass(frozen=True)
class Search:
    """What the search found.

    Attributes:
        null: the model as given, constants refitted.
        final: the supported hypothesis, jointly refitted.
        rounds: of the forward search, the first on the model as given.
        members: for each effect of `final`, all candidates in its place with the others kept.
        posed: the problem, with the noise as settled in the end.
        alone: the law that explains more than several effects, where that ended the search.
    """

    null: Fit
    final: Fit
    rounds: tuple[Round, ...]
    members: tuple[Round, ...]
    posed: Posed
    alone: Found | None = None

    @property
    def problem(self) -> Problem:
        """The short windows that the search was made in."""
        return self.posed.problem


@dataclass(frozen=True)
class Trial:
    """Tries every candidate that is not in a hypothesis yet; see `explore`."""

    pool: Sequence[Candidate]
    scales: Scales
    short: Sequence[Windows]
    progress: Callable[[str], None] = lambda _: None

    def __call__(self, posed: Posed, null: Fit, full: Fit | None) -> Round:
        """One round on top of `null`; `full` is `null` with an effect that is to be defended."""
        untried = [c for c in self.pool if c not in null.hypothesis.candidates]
        return explore(posed, null, untried, self.scales, self.short, self.progress, full)


def search(
    recordings: Sequence[Recording],
    hold_out: Sequence[Recording],
    model: Model,
    extra: Sequence[Effect] = (),
    progress: Callable[[str], None] = lambda _: None,
    posed: Posed | None = None,
    instead: Callable[[Search], Found | None] = lambda _: None,
) -> Search:
    """Forward selection with joint refit; then every effect defends its place.

    An effect is dear to find on the ground: where three do not do there, a law is tried instead.

    Args:
        recordings: what to learn from; without `hold_out` every fourth block is held out.
        hold_out: whole bags no fit may see.
        model: the model to explain; its uncertain constants are refitted in every hypothesis.
        extra: a user's own effects.
        progress: told what is being tried.
        posed: the problem where it is posed already.
        instead: the law that explains more than the effects found so far, if any.
    """
    posed = standing(posed or pose(recordings, hold_out, model))
    short = noise.short_windows([*recordings, *hold_out])
    scales = scales_of(model, posed.problem.windows)
    tried = Trial(candidates(model, extra), scales, short, progress)
    first = fit(posed.problem, Hypothesis(constants=uncertain(model)))
    rounds = forward(posed, first, tried, SEVERAL)
    best = _leading(rounds)
    if len(best.hypothesis.candidates) == SEVERAL:
        if ended := _ended(first, rounds, instead):
            return ended
        rounds += forward(rounds[-1].posed, best, tried)
    reviewed = settled(rounds, tried)
    first = fit(reviewed.posed.problem, first.hypothesis, first.theta, first.start)
    members = tuple(reviewed.members[c] for c in reviewed.final.hypothesis.candidates)
    return Search(first, reviewed.final, tuple(rounds), members, reviewed.posed)


def finished(found: Search) -> Search:
    """The same with the final parameters of a robot on the ground brought to their best."""
    if not (found.problem.footing and found.final.hypothesis.size):
        return found
    posed, final = polished(found.posed, found.final)
    return replace(found, final=final, posed=posed)


def _ended(
    first: Fit, rounds: Sequence[Round], instead: Callable[[Search], Found | None]
) -> Search | None:
    """The search on the ground if one law explains more than what it found, which leaves much."""
    best, posed = _leading(rounds), rounds[-1].posed
    if not posed.problem.footing or unexplained(best) < WHOLE:
        return None
    null = fit(posed.problem, first.hypothesis, first.theta, first.start)
    so_far = Search(null, best, tuple(rounds), (), posed)
    alone = instead(so_far)
    return replace(so_far, alone=alone) if alone else None


def _leading(rounds: Sequence[Round]) -> Fit:
    """The fit of the last effect that a round found, or without one."""
    last = rounds[-1]
    return last.best.fit if last.best is not None and last.best.fit else last.null


def forward(
    posed: Posed, null: Fit, tried: Explore, most: float = np.inf
) -> list[Round]:
    """Rounds, each on top of the best of the one before, until nothing more is supported."""
    rounds = [tried(posed, null, None)]
    while (best := rounds[-1].best) is not None and best.fit is not None:
        if len(best.fit.hypothesis.candidates) >= min(most, MOST_EFFECTS):
            break
        rounds.append(tried(rounds[-1].posed, best.fit, None))
    return rounds


def settled(rounds: Sequence[Round], tried: Explore) -> Reviewed:
    """Review the set that forward search found; where that changes it, search on from there.

    Where that finds nothing more, and no other noise, the review still holds.
    """
    for _ in range(MOST_REVIEWS):
        full = _leading(rounds)
        reviewed = review(rounds[-1].posed, full, _known(rounds, full), tried)
        if not reviewed.changed:
            break
        rounds = forward(reviewed.posed, reviewed.final, tried)
        if _nothing_new(reviewed.posed, rounds):
            return replace(reviewed, final=rounds[0].null, posed=rounds[0].posed)
    return reviewed


def _nothing_new(posed: Posed, rounds: Sequence[Round]) -> bool:
    """Whether forward search from there found no effect, and the noise to be the same."""
    sigma = rounds[0].posed.problem.sigma
    return rounds[0].best is None and np.array_equal(sigma, posed.problem.sigma)


def _known(rounds: Sequence[Round], full: Fit) -> dict[Candidate, Round]:
    """The round of the effect found last: all others were in the model already."""
    kept = full.hypothesis.candidates
    for step in rounds:
        if step.best and set(kept) == {*step.null.hypothesis.candidates, step.best.candidate}:
            return {step.best.candidate: step}
    return {}


def uncertain(model: Model) -> tuple[Constant, ...]:
    """The constants that are refitted with every hypothesis."""
    return tuple(
        replace(c, value=float(model.constants[path]))
        for path, c in model.robot.constants.items()
        if c.uncertain
    )


def scales_of(model: Model, windows: Windows) -> Scales:
    """Sizes of this robot and this data, for choosing amplitudes."""
    return Scales(
        torque=torque_scale(model.robot),
        rate=max(float(np.sqrt((windows.dq**2).mean())), 1e-3),
        angle=max(float(np.abs(windows.q).max(initial=0.0)), 1.0),
        inertia=inertia_scale(model.robot),
        mass=mass_scale(model.robot),
        input=max(float(np.abs(windows.inputs).max(initial=0.0)), 1e-9),
    )
