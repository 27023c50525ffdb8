# SPDX-License-Identifier: Apache-2.0
"""The report of `leo explain`."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
import re

import numpy as np

from leo_diffmodel.bags.recording import Recording
from leo_diffmodel.compare.errors import horizon_table, horizon_windows, Prediction
from leo_diffmodel.compare.headline import Headline
from leo_diffmodel.compare.pushes import predict
from leo_diffmodel.compare.where import where as places_of
from leo_diffmodel.explain.explanation import Explanation
from leo_diffmodel.explain.select.search import Search
from leo_diffmodel.report import page
from leo_diffmodel.report.page import Section
from leo_diffmodel.report.sections import (
    budget,
    edited,
    gates,
    health,
    horizon,
    hypotheses,
    missing,
    moving,
    origin,
    outside,
    stability,
    unknown,
    untested,
    verdict,
    where,
)
from leo_diffmodel.report.torque_curves import trace
from leo_diffmodel.report.worst import before_and_after, stretches
from leo_sim.model import Model

OUTSIDE = re.compile(r'moved from outside', re.IGNORECASE)
MOST_WINDOWS = 100


def write_explanation(
    path: Path, explanation: Explanation, recordings: Sequence[Recording], watch: str = ''
) -> None:
    """Write the report of `leo explain`.

    Args:
        path: the HTML file; replaced whole or not at all.
        explanation: the result; without a search (untestable, or moved from outside) the page
            has no figures.
        recordings: what it was computed from, held-out bags included.
        watch: the command that opens the live page on the same data; '' names none.
    """
    sections = [verdict.answer(explanation)]
    if explanation.search is not None:
        sections += _evidence(explanation, recordings)
    if explanation.unknown is not None:
        sections.insert(1, unknown.section(explanation.unknown))
    if explanation.edit_test is not None:
        sections.insert(1, edited.section(explanation.edit_test))
    if cut := OUTSIDE.search(explanation.sentence):
        sections.append(outside.section(recordings, _given(explanation)))
    if explanation.search is not None or not cut:
        sections.append(untested.section(explanation.not_testable))
    if explanation.settings:
        sections.append(gates.section(explanation.settings, explanation.search))
    sections.append(origin.section(explanation.provenance, recordings, explanation.seconds))
    title = f'{explanation.model.robot.name}: what the model lacks'
    page.write(path, page.render(title, page.source(recordings), sections, watch))


def _given(explanation: Explanation) -> Model:
    """The model without what was found."""
    return explanation.search.problem.base if explanation.search else explanation.model


def _evidence(explanation: Explanation, recordings: Sequence[Recording]) -> list[Section]:
    """The sections that a finished search fills."""
    found, errors = explanation.search, explanation.errors
    assert found is not None
    recordings = list(explanation.used)
    curves = trace(recordings, found)
    worst = stretches(before_and_after(recordings, found))
    return [
        budget.explained(errors),
        where.section(places_of(curves.measured, curves.model), curves.model, recordings, worst),
        *(
            moving.section(s, curves.model.robot, where.title(s, curves.model, recordings))
            for s in worst[:1]
        ),
        missing.section(curves.measured, curves.model.robot, curves.candidates),
        hypotheses.section(
            explanation.effects,
            explanation.hypotheses,
            explanation.constants,
            found.threshold,
            Headline(errors['statistic'], errors['ladder'][0]['seconds']).short,
            found.problem.gates,
        ),
        stability.section(explanation.stability, explanation.effects, explanation.settings),
        horizon.held_out(errors, bool(explanation.effects), _training(explanation, recordings)),
        health.section(found, errors),
    ]


def _training(explanation: Explanation, recordings: Sequence[Recording]) -> list[dict]:
    """Errors on the data that the fits saw, at the horizons of the held-out ones."""
    rows, found = explanation.errors['horizon'], explanation.search
    assert found is not None
    step = rows[-1]['seconds'] / rows[-1]['steps']
    return training_errors(recordings, found, rows[-1]['seconds'], step)


def training_errors(
    recordings: Sequence[Recording], found: Search, seconds: float, step: float
) -> list[dict]:
    """Rows {steps, before, after} of rms errors against horizon on training data.

    Args:
        recordings: all bags, in the order of the search.
        found: the finished search.
        seconds: the longest horizon.
        step: one control period [s].
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
