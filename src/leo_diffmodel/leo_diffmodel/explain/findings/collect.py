# SPDX-License-Identifier: Apache-2.0
"""From a finished search to everything that an answer is told from."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from scipy.special import stdtrit

from leo_diffmodel.bags.recording import Recording
from leo_diffmodel.compare import errors
from leo_diffmodel.compare.errors import Prediction
from leo_diffmodel.explain.estimate.estimator import Progress, STEPS
from leo_diffmodel.explain.estimate.finish import completed
from leo_diffmodel.explain.estimate.fitted import Fit, rest_of
from leo_diffmodel.explain.findings import parts
from leo_diffmodel.explain.findings.choices import choices, other
from leo_diffmodel.explain.findings.findings import Findings
from leo_diffmodel.explain.findings.held_out import HeldOut
from leo_diffmodel.explain.findings.own_values import own_values
from leo_diffmodel.explain.findings.shown import shown_for
from leo_diffmodel.explain.findings.windows import validation_windows
from leo_diffmodel.explain.problem.classes import Facts
from leo_diffmodel.explain.select.search import Search
from leo_diffmodel.explain.select.sets import Names
from leo_diffmodel.explain.select.stable import holds
from leo_diffmodel.explain.unknown.answer import tell, Unknown
from leo_diffmodel.explain.unknown.find import find, Found, without
from leo_diffmodel.explain.unknown.paths import with_past
from leo_sim.description.robot import Constant
from leo_sim.model import Model

Array = np.ndarray


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
        held = replace(held, windows=with_past(recordings, held.windows, held.problem.numerics))
    before, after = (held.headline.mean(held.figures(f)) for f in (law.beside, unknown.fit))
    return replace(unknown, error_before=before, error_after=after)


def _judged(
    found: Search,
    held: HeldOut,
    facts: Facts,
    step: float,
    bags: tuple[str, ...],
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
            'one_step': one_step(before, after, step),
            'horizon': horizon(before, after, step),
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
        shown=shown_for(
            problem.windows, held.model(found.final), found.final.hypothesis.candidates, facts
        ),
    )


def refuted(found: Search, held: HeldOut, facts: Facts) -> str:
    """The set with the surely smallest held-out error, in words; '' where the chosen one has it.

    Of sets that lack a chosen effect, by any name, and have one effect more at most. The error is
    that of `leo compare`: squared, so far ahead of the measured start. A set is better where it
    saves a good part of that (`material`), and surely over stretches of time (Student's t).
    """
    chosen, floor = found.chosen.names, held.predict(found.final).floor.mean(axis=(0, 1))
    _, block = np.unique(found.posed.blocks.index(held.windows), return_inverse=True)
    gates = found.weight.gates
    if len(np.unique(block)) < gates.fewest_blocks:
        return ''
    mine, least = _squares(held, found.final, floor), stdtrit(block.max(), gates.surely)
    better: dict[Names, float] = {}
    for rival in found.sets:
        lacks = any(not holds(rival.names, c, facts.alike) for c in chosen)
        if lacks and len(rival.names) <= len(chosen) + 1:
            saved = np.bincount(block, mine - _squares(held, rival.fit, floor))
            share, errors = saved.sum() / mine.sum(), np.sqrt(len(saved)) * saved.std(ddof=1)
            if share > gates.material and saved.sum() > least * errors:
                better[rival.names] = share
    best = max(better, key=better.__getitem__, default=None)
    if best is None:
        return ''
    return ' + '.join(sorted(c.label for c in best)) or 'the model as given'


def _squares(held: HeldOut, fitted: Fit, floor: Array) -> Array:
    """Squared error of each window, mean over the states in units of their noise floor, (W,)."""
    square: Array = (held.ahead(fitted) ** 2 / floor).mean(axis=-1)
    return square


def one_step(before: Prediction, after: Prediction, step: float) -> dict:
    """Root mean square errors of each state one control period ahead, and their mean."""
    early, late = (errors.one_step(p, step) for p in (before, after))
    return _beside(early['rmse'], late['rmse'], late['noise_floor']['rmse'])


def horizon(before: Prediction, after: Prediction, step: float) -> list[dict]:
    """Root mean square errors of each state and their mean, at growing times ahead."""
    tables = (errors.horizon_table(p, step) for p in (before, after))
    return [
        {
            'steps': b['steps'],
            'seconds': b['seconds'],
            **_beside(b['rmse'], a['rmse'], a['noise_floor']),
        }
        for b, a in zip(*tables, strict=True)
    ]


def _beside(before: list[float], after: list[float], floor: list[float]) -> dict:
    figures = {'before': before, 'after': after, 'noise_floor': floor}
    return {**figures, 'mean': {name: float(np.mean(x)) for name, x in figures.items()}}
