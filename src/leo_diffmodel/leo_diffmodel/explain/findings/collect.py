# SPDX-License-Identifier: Apache-2.0
"""From a finished search to everything that an answer is told from."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

from leo_diffmodel.bags.recording import Recording
from leo_diffmodel.compare import errors
from leo_diffmodel.explain.estimate.estimator import Progress, STEPS
from leo_diffmodel.explain.estimate.loss import rest_of
from leo_diffmodel.explain.estimate.own_constants import completed
from leo_diffmodel.explain.findings import parts, tables
from leo_diffmodel.explain.findings.choices import choices, other
from leo_diffmodel.explain.findings.findings import Findings
from leo_diffmodel.explain.findings.held_out import HeldOut
from leo_diffmodel.explain.findings.own_values import own_values
from leo_diffmodel.explain.findings.refuted import refuted
from leo_diffmodel.explain.findings.shown import shown_for
from leo_diffmodel.explain.findings.windows import validation_windows
from leo_diffmodel.explain.problem.classes import Facts
from leo_diffmodel.explain.select.search import Search
from leo_diffmodel.explain.unknown.answer import tell, Unknown
from leo_diffmodel.explain.unknown.find import find, Found, without
from leo_diffmodel.explain.unknown.paths import with_past
from leo_sim.description.robot import Constant
from leo_sim.model import Model


def collect(
    recordings: Sequence[Recording],
    model: Model,
    found: Search,
    facts: Facts,
    step: float,
    own: Sequence[Constant] = (),
    progress: Progress = lambda *_: None,
) -> Findings:
    """Look for a law that is no known effect, and judge each chosen effect beside the others.

    Args:
        recordings: what the search was made in, held-out ones last.
        model: the model as given.
        found: the search.
        facts: what decides which effects are the same thing.
        step: one control period [s].
        own: constants that held-out recordings have of their own.
        progress: told what comes next.
    """
    progress('what no known effect explains', STEPS.end // 2)
    found, law = _with_law(recordings, found)
    null, final = (completed(found.problem, f, own) for f in (found.null, found.final))
    found = replace(found, null=null, final=final)
    law = law and law.completed(own)
    windows = validation_windows(recordings, found, model)
    held = HeldOut(found.problem, model, windows, tuple(own))
    held = held.undisturbed(law.attempt.fit if law and law.attempt.effect else found.final)
    unknown = _told(recordings, law, held) if law else None
    return _judged(found, held, facts, step, tuple(r.name for r in recordings), unknown)


def _with_law(recordings: Sequence[Recording], found: Search) -> tuple[Search, Found | None]:
    """The search beside the law that is no known effect, and that law; None where there is none.

    A search that was cut short, or that leaves no time for it, knows none.
    """
    if not found.complete:
        return found, None
    law = None if found.problem.late() else find(recordings, found)
    if found.problem.late():
        return replace(found, untried=('a law that is no known effect',)), None
    return (without(found, law), law) if law else (found, None)


def _told(recordings: Sequence[Recording], law: Found, held: HeldOut) -> Unknown:
    """The law that is no known effect, with what it does to the held-out error."""
    unknown = tell(law)
    if unknown.fit is None:
        return unknown
    if unknown.variable == 'path':
        held = replace(held, windows=with_past(recordings, held.windows,
                                                held.problem.numerics))  # fmt: skip
    before, after = (held.headline.mean(held.figures(f)) for f in (law.beside, unknown.fit))
    return replace(unknown, error_before=before, error_after=after)


def _judged(
    found: Search, held: HeldOut, facts: Facts, step: float, bags: tuple[str, ...],
    unknown: Unknown | None,
) -> Findings:
    gates, problem = found.weight.gates, found.problem
    before, after = held.predict(found.null), held.predict(found.final)
    smaller = parts.without(found)
    return Findings(
        search=found,
        base=held.base,
        facts=facts,
        headline=held.headline,
        errors={
            'states': errors.state_names(held.base),
            'one_step': tables.one_step(before, after, step),
            'horizon': tables.horizon(before, after, step),
        },
        windows=held.windows.count,
        floor=held.headline.floor(after),
        ladder=tuple(parts.ladder(found, held)),
        effects=tuple(parts.effects(found, smaller, held, facts)),
        singles=tuple(parts.singles(found, held, facts)),
        floors=parts.floors(found, smaller, held) if len(smaller) >= gates.many else (),
        own=own_values(problem, found.final, bags, gates.fewest_blocks),
        choices=choices(found, facts),
        other=other(found, facts),
        refuted=refuted(found, held, facts),
        rest=rest_of(problem, found.null, found.final),
        unknown=unknown,
        bags=bags,
        shown=shown_for(problem.windows, held.model(found.final),
                        found.final.hypothesis.candidates, facts),
    )
