# SPDX-License-Identifier: Apache-2.0
"""From a finished search to all findings: the last fits and predictions of an answer."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from leo_diffmodel.bags.recording import Recording
from leo_diffmodel.compare import errors
from leo_diffmodel.compare.errors import Prediction
from leo_diffmodel.explain.estimate.estimator import Progress, STEPS
from leo_diffmodel.explain.estimate.finish import completed
from leo_diffmodel.explain.estimate.fitted import rest_of
from leo_diffmodel.explain.findings import parts
from leo_diffmodel.explain.findings.choices import choices, last_word, other, refuted
from leo_diffmodel.explain.findings.findings import Findings
from leo_diffmodel.explain.findings.held_out import HeldOut
from leo_diffmodel.explain.problem.classes import Facts
from leo_diffmodel.explain.select.search import Search
from leo_diffmodel.explain.unknown.answer import Unknown
from leo_diffmodel.explain.unknown.attempt import with_past
from leo_diffmodel.explain.unknown.find import find, Found, without
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
    """Look for a law that is no known effect, and judge each chosen effect next to the others.

    `step` is one control period [s], `own` are the constants that held-out recordings have of
    their own.
    """
    progress('what no known effect explains', STEPS.end // 2)
    if found.complete:
        held = HeldOut.of(recordings, found.posed, found.final, model, own)
        found = last_word(found, held.undisturbed(found.final), facts)
    found, law = _with_law(recordings, found)
    null, final = (completed(found.problem, f, own) for f in (found.null, found.final))
    found = replace(found, null=null, final=final)
    law = law and law.completed(own)
    held = HeldOut.of(recordings, found.posed, found.final, model, own)
    held = held.undisturbed(law.attempt.fit if law and law.attempt.effect else found.final)
    unknown = _unknown(recordings, law, held) if law else None
    return _judged(found, held, facts, step, tuple(r.name for r in recordings), unknown)


def _with_law(recordings: Sequence[Recording], found: Search) -> tuple[Search, Found | None]:
    """The search next to the law that is no known effect, and that law; None without one.

    A search that was cut short, or that leaves no time for it, knows none.
    """
    if not found.complete:
        return found, None
    law = None if found.problem.late() else find(recordings, found)
    if found.problem.late():
        return replace(found, untried=('a law that is no known effect',)), None
    return (without(found, law), law) if law else (found, None)


def _unknown(recordings: Sequence[Recording], law: Found, held: HeldOut) -> Unknown:
    """The law that is no known effect, with what it does to the held-out error."""
    unknown = Unknown.of_law(law)
    if unknown.fit is None:
        return unknown
    if unknown.variable == 'path':
        held = replace(held, windows=with_past(recordings, held.windows, held.problem.numerics))
    before, after = (held.headline.mean(held.figures(f)) for f in (law.base, unknown.fit))
    return replace(unknown, error_before=before, error_after=after)


def _judged(
    found: Search,
    held: HeldOut,
    facts: Facts,
    step: float,
    bags: tuple[str, ...],
    unknown: Unknown | None,
) -> Findings:
    problem, smaller = found.problem, parts.without(found)
    before, after = held.predict(found.null), held.predict(found.final)
    many, chosen = len(smaller) >= found.weight.gates.many, found.final.hypothesis.candidates
    return Findings(
        search=found,
        base=held.base,
        facts=facts,
        headline=held.headline,
        errors={'states': errors.state_names(held.base), **_tables(before, after, step)},
        windows=held.windows.count,
        floor=held.headline.floor(after),
        ladder=tuple(parts.ladder(found, held)),
        effects=tuple(parts.effects(found, smaller, held, facts)),
        singles=tuple(parts.singles(found, held, facts)),
        floors=parts.floors(found, smaller, held) if many else (),
        own=parts.own_values(problem, found.final, bags),
        choices=choices(found, facts),
        other=other(found, facts),
        refuted=refuted(found, held, facts),
        rest=rest_of(problem, found.null, found.final),
        unknown=unknown,
        bags=bags,
        shown=parts.shown_for(problem.windows, held.model(found.final), chosen, facts),
    )


def _tables(before: Prediction, after: Prediction, step: float) -> dict:
    """Rms errors of each state and their mean, one control period ahead and further."""
    b, a = (errors.one_step(p, step) for p in (before, after))
    one, further = _figures(b['rmse'], a['rmse'], a['noise_floor']['rmse']), []
    tables = (errors.horizon_table(p, step) for p in (before, after))
    for b, a in zip(*tables, strict=True):
        figures = _figures(b['rmse'], a['rmse'], a['noise_floor'])
        further.append({'steps': b['steps'], 'seconds': b['seconds'], **figures})
    return {'one_step': one, 'horizon': further}


def _figures(before: list[float], after: list[float], floor: list[float]) -> dict:
    figures = {'before': before, 'after': after, 'noise_floor': floor}
    return {**figures, 'mean': {name: float(np.mean(x)) for name, x in figures.items()}}
