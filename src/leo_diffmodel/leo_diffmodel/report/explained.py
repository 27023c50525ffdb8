# SPDX-License-Identifier: Apache-2.0
"""The report of `leo explain`."""

import math
from pathlib import Path

import numpy as np

from leo_diffmodel.bags.recording import Recordings
from leo_diffmodel.compare.errors import horizon_table, horizon_windows, Prediction
from leo_diffmodel.compare.headline import Headline
from leo_diffmodel.compare.pushes import predict
from leo_diffmodel.compare.torque import lacking_and_supposed, MissingTorque
from leo_diffmodel.compare.where import where as places_of
from leo_diffmodel.explain.estimate.fitted import Fit
from leo_diffmodel.explain.explanation import Explanation
from leo_diffmodel.explain.select.search import Search
from leo_diffmodel.report.page import render, Section
from leo_diffmodel.report.sections import (
    budget,
    decided,
    health,
    horizon,
    hypotheses,
    missing,
    moving,
    origin,
    unknown,
    verdict,
    where,
)
from leo_diffmodel.report.text import source
from leo_diffmodel.report.worst import before_and_after, stretches
from leo_msgs_py.ending import ending
from leo_msgs_py.whole_file import json_text, write_together
from leo_sim.model import Model

MOST_WINDOWS = 100
MOST_CURVES = 4


def write_explanation(
    folder: Path, result: Explanation, recordings: Recordings, watch: str, until: float = math.inf
) -> None:
    """Write explain.json and report.html, or neither; made by then [s of `time.monotonic`]."""
    with ending(until):
        page = explanation_page(result, recordings, watch)
    answer = json_text(result.to_json())
    write_together({folder / 'explain.json': answer, folder / 'report.html': page})


def explanation_page(explanation: Explanation, recordings: Recordings, watch: str = '') -> str:
    """The report of `leo explain`; without a search (untestable, moved) it has no figures.

    The recordings include held-out bags; `watch` opens the live page on the same data.
    """
    sections = [verdict.answer(explanation)]
    if explanation.search is not None:
        sections += _evidence(explanation)
    if explanation.unknown is not None:
        sections.insert(1, unknown.section(explanation.unknown))
    if explanation.edit_test is not None:
        sections.insert(1, decided.edit_test(explanation.edit_test))
    if explanation.left_out:
        sections.append(decided.left_out(recordings, explanation.left_out))
    if explanation.search is not None or not explanation.left_out:
        sections.append(decided.untested(explanation.not_testable))
    if explanation.settings:
        sections.append(decided.gates(explanation.settings, explanation.search))
    sections.append(origin.section(explanation.provenance, recordings, explanation.seconds))
    title = f'{explanation.model.robot.name}: what the model lacks'
    return render(title, source(recordings), sections, watch)


def _evidence(explanation: Explanation) -> list[Section]:
    found, errors, recordings = explanation.search, explanation.errors, list(explanation.used)
    assert found is not None
    model, measured, curves = trace(recordings, found)
    worst = stretches(before_and_after(recordings, found))
    far = errors['horizon'][-1]
    training = _training_errors(recordings, found, far['seconds'], far['seconds'] / far['steps'])
    return [
        budget.explained(errors),
        where.section(places_of(measured, model), model, recordings, worst),
        *(moving.section(s, model.robot, where.title(s, model, recordings)) for s in worst[:1]),
        missing.section(measured, model.robot, curves),
        hypotheses.section(
            explanation.found,
            explanation.hypotheses,
            explanation.constants,
            found.threshold,
            Headline(errors['statistic'], errors['ladder'][0]['seconds']).short,
            found.problem.gates,
        ),
        decided.stability(explanation.stability, explanation.found, explanation.settings),
        horizon.held_out(errors, bool(explanation.effects), training),
        health.section(found, errors),
    ]


def _training_errors(
    recordings: Recordings, found: Search, seconds: float, step: float
) -> list[dict]:
    """Rows {steps, before, after} of rms errors on training data up to a horizon [s].

    One step is a control period [s]; there are no rows where no window is that long.
    """
    base, blocks = found.problem.base, found.posed.blocks
    models = [fit.hypothesis.model(base, fit.theta) for fit in (found.null, found.final)]
    try:
        windows = horizon_windows(recordings, models[1], seconds, 4 * MOST_WINDOWS)
    except ValueError:
        return []
    train = np.flatnonzero(blocks.train(windows))
    if not train.size:
        return []
    windows = windows.take(train[:: -(-train.size // MOST_WINDOWS)])
    start, none = windows.measured[:, 0], np.zeros_like(windows.measured)
    predictions = [Prediction(windows, predict(m, windows, start), none) for m in models]
    tables = [horizon_table(p, step) for p in predictions]
    return [
        {'steps': b['steps'], 'before': b['rmse'], 'after': a['rmse']}
        for b, a in zip(*tables, strict=True)
    ]


def trace(
    recordings: Recordings, found: Search
) -> tuple[Model, MissingTorque, dict[str, np.ndarray]]:
    """The torque that the model lacks, and how each leading hypothesis says it should look.

    A hypothesis' curve is the same estimator applied to the same windows, with the measured
    states replaced by the ones that the model with its effects predicts.

    Returns the model as given, constants refitted; the estimate from the data; and by hypothesis,
    the supported one first, the torque by its effects [N m], shape (W, J).
    """
    base, sigma, final = found.problem.base, found.problem.sigma, found.final
    own = final.hypothesis.model(base, final.theta).by_recording  # no other fit has the held-out
    base = base.changed(by_recording=own)
    model = found.null.hypothesis.model(base, found.null.theta)
    true = {name: fit.hypothesis.model(base, fit.theta) for name, fit in _leading(found)}
    return model, *lacking_and_supposed(recordings, model, true, sigma)


def _leading(found: Search) -> list[tuple[str, Fit]]:
    final, empty = found.final, found.known(frozenset())
    leading = [(' + '.join(c.label for c in final.hypothesis.candidates), final)]
    leading += [
        (next(iter(s.names)).label, s.fit)
        for s in found.sets
        if len(s.names) == 1 and empty and found.weight.ahead(s, empty) > found.threshold
    ]
    unique = {name: fitted for name, fitted in reversed(leading) if name}
    return [(name, unique[name]) for name in dict(leading) if name][:MOST_CURVES]
