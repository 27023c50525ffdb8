# SPDX-License-Identifier: Apache-2.0
"""From a finished search to all findings."""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from leo_diffmodel.bags.recording import Recordings
from leo_diffmodel.compare import errors
from leo_diffmodel.compare.errors import Prediction
from leo_diffmodel.compare.windows import with_past
from leo_diffmodel.explain.estimate.estimator import FIT, PART, Progress, SCAN
from leo_diffmodel.explain.estimate.fitted import rest_of
from leo_diffmodel.explain.findings import parts
from leo_diffmodel.explain.findings.choices import choices, others, refuting
from leo_diffmodel.explain.findings.findings import Findings
from leo_diffmodel.explain.findings.last_fits import finish, Finished
from leo_diffmodel.explain.problem.classes import Facts
from leo_diffmodel.explain.select.search import Search
from leo_diffmodel.explain.unknown.answer import Unknown
from leo_msgs_py.console import Reporter
from leo_sim.description.robot import Constant
from leo_sim.model import Model


def collect(
    recordings: Recordings,
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
    reporter, numerics = Reporter.of(progress), found.problem.numerics
    reporter.expect({SCAN: 0, PART: 0, FIT: numerics.law_fits + numerics.findings_fits})
    done = finish(recordings, model, found, facts, own, reporter)
    reporter('held-out errors', 1, FIT)
    reporter.expect({FIT: numerics.findings_fits})
    found, held, bags = done.search, done.held, tuple(r.name for r in recordings)
    before, after = held.predict(found.null), held.predict(found.final)
    chosen, windows = found.final.hypothesis.candidates, found.problem.windows
    return Findings(
        search=found,
        base=held.base,
        facts=facts,
        headline=held.headline,
        errors={'states': errors.state_names(held.base), **_tables(before, after, step)},
        windows=held.windows.count,
        floor=held.headline.floor(after),
        ladder=tuple(parts.ladder(done)),
        effects=tuple(parts.effects(done, facts)),
        singles=tuple(parts.singles(done, facts)),
        of_sets=tuple(held.figures(s.fit) for s in found.sets),
        floors=parts.floors(done) if len(chosen) >= found.weight.gates.many else (),
        by_recording=parts.values_by_recording(found.problem, found.final, bags),
        choices=choices(found, facts),
        others=others(found, facts),
        refuting=refuting(found, held, facts),
        rest=rest_of(found.problem, found.null, found.final),
        unknown=_unknown(recordings, done),
        bags=bags,
        shown=parts.shown_for(windows, held.model(found.final), chosen, facts),
    )


def _unknown(recordings: Recordings, done: Finished) -> Unknown | None:
    """The law that is no known effect, with what it does to the held-out error."""
    if done.law is None:
        return None
    unknown, held = Unknown.of_law(done.law), done.held
    if unknown.fit is None:
        return unknown
    if unknown.variable == 'path':
        past = held.problem.numerics.past_samples
        held = replace(held, windows=with_past(recordings, held.windows, past))
    before, after = (held.headline.mean(held.figures(f)) for f in (done.law.base, unknown.fit))
    return replace(unknown, error_before=before, error_after=after)


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
