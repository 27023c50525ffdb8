# SPDX-License-Identifier: Apache-2.0
"""The last fits of an answer: what held-out data choose, the law beside it, and parts of it.

Findings are read off them: nothing is fitted after this.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace

from leo_diffmodel.bags.recording import Recordings
from leo_diffmodel.explain.estimate.estimator import Estimate, Progress
from leo_diffmodel.explain.estimate.fit import fit
from leo_diffmodel.explain.estimate.fitted import Fit, linear_part
from leo_diffmodel.explain.findings.choices import last_word
from leo_diffmodel.explain.findings.held_out import HeldOut
from leo_diffmodel.explain.problem.classes import Facts
from leo_diffmodel.explain.problem.hypothesis import Candidate
from leo_diffmodel.explain.select.evidence import score, Scored
from leo_diffmodel.explain.select.search import Search
from leo_diffmodel.explain.unknown.attempt import Attempt
from leo_diffmodel.explain.unknown.find import find, without
from leo_sim.description.robot import Constant
from leo_sim.model import Model


@dataclass(frozen=True)
class Finished:
    """Every hypothesis that an answer speaks of, and the windows that judge them."""

    search: Search  # its `null` and `final` completed
    law: Attempt | None  # the law that is no known effect
    held: HeldOut
    smaller: tuple[Scored, ...]  # the chosen hypothesis less each of its effects
    growing: tuple[Fit, ...]  # its first effect alone, its first two, and so on


def finish(
    recordings: Recordings,
    model: Model,
    found: Search,
    facts: Facts,
    own: Sequence[Constant],
    progress: Progress = lambda *_: None,
) -> Finished:
    """Make the last choice and the last fits; `own` are constants of held-out recordings alone."""
    if found.complete:
        held = HeldOut.of(recordings, found.posed, found.final, model, own)
        found = last_word(found, held.undisturbed(found.final), facts)
    progress('what no known effect explains', 0)
    found, law = _with_law(recordings, found, progress)
    held = HeldOut.of(recordings, found.posed, found.final, model, own)
    found = replace(found, null=held.completed(found.null), final=held.completed(found.final))
    law = law and _completed(law, held)
    held = held.undisturbed(law.fit if law and law.effect else found.final)
    names = found.final.hypothesis.candidates
    smaller = tuple(_less(found, c) for c in names)
    growing = tuple(_first(found, count) for count in range(1, len(names) + 1))
    for part in (*found.sets, found.chosen, *smaller):
        held.completed(part.fit, part.at.problem)
    return Finished(found, law, held, smaller, growing)


def _with_law(
    recordings: Recordings, found: Search, progress: Progress
) -> tuple[Search, Attempt | None]:
    """The search next to the law that is no known effect, and that law; None without one.

    A search that was cut short, or that leaves no time for it, knows none.
    """
    if not found.complete:
        return found, None
    law = None if found.problem.late() else find(recordings, found, progress)
    if found.problem.late():
        return replace(found, untried=('a law that is no known effect',)), None
    return (without(found, law), law) if law else (found, None)


def _completed(law: Attempt, held: HeldOut) -> Attempt:
    problem = law.scored.at.problem
    whole = law.refitted(held.completed(law.fit, problem)) if law.effect else law
    return replace(whole, base=held.completed(law.base, problem))


def _less(found: Search, candidate: Candidate) -> Scored:
    """The chosen set less an effect, by its linear answer if it was not fitted, as of many."""
    chosen, problem = found.chosen, found.chosen.at.problem
    if known := found.known(chosen.names - {candidate}):
        return known
    if len(chosen.names) > problem.gates.many:
        part = linear_part(problem, chosen.fit, [candidate])
    else:
        full = chosen.fit.hypothesis
        rest = full.without(full.candidates.index(candidate))
        part = fit(problem, rest, rest.carried(full, chosen.fit.theta), chosen.fit.start)
    return score(Estimate(chosen.at.posed, part))


def _first(found: Search, count: int) -> Fit:
    """The first effects of the final set without the others, as far as that is straight."""
    full, names = found.final, found.final.hypothesis.candidates
    if count == len(names):
        return full
    known = found.known(frozenset(names[:count]))
    return known.fit if known else linear_part(found.problem, full, names[count:])
