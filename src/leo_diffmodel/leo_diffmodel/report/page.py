# SPDX-License-Identifier: Apache-2.0
"""report.html: one file that needs no network, assembled from sections."""

from __future__ import annotations

from collections.abc import Sequence
from functools import cache
import os
from pathlib import Path
from typing import Any

from bokeh.embed import components
from bokeh.resources import Resources
import jinja2

from leo_diffmodel.bags.recording import Recording
from leo_diffmodel.compare.comparison import Comparison
from leo_diffmodel.explain.explanation import Explanation
from leo_diffmodel.report import palette, text
from leo_diffmodel.report.section import Section
from leo_diffmodel.report.sections import (
    budget,
    health,
    horizon,
    hypotheses,
    missing,
    origin,
    verdict,
    where,
)
from leo_diffmodel.report.torque_curves import trace
from leo_sim.model import Model

BOKEH_PARTS = ['bokeh']


def write_comparison(
    path: Path, comparison: Comparison, recordings: Sequence[Recording], model: Model
) -> None:
    """Write the report of `leo compare`.

    Args:
        path: the HTML file; replaced whole or not at all.
        comparison: the result.
        recordings: what it was computed from.
        model: the model that was compared.
    """
    data, robot = comparison.data, model.robot
    sections = [
        verdict.score(data),
        budget.measured(data['budget']),
        horizon.plain(data),
        missing.section(comparison.missing, robot),
        where.section(comparison.missing, model),
        origin.section(data['provenance'], recordings),
    ]
    _write(path, render(f'{robot.name}: model against data', _source(recordings), sections))


def write_explanation(
    path: Path, explanation: Explanation, recordings: Sequence[Recording]
) -> None:
    """Write the report of `leo explain`.

    Args:
        path: the HTML file; replaced whole or not at all.
        explanation: the result; without a search (untestable) the page has no figures.
        recordings: what it was computed from, held-out bags included.
    """
    robot = explanation.model.robot
    sections = [verdict.answer(explanation)]
    if explanation.search is not None:
        sections += _evidence(explanation, recordings)
    sections.append(origin.section(explanation.provenance, recordings))
    _write(path, render(f'{robot.name}: what the model lacks', _source(recordings), sections))


def render(title: str, source: str, sections: Sequence[Section]) -> str:
    """The page as HTML; bokeh's script is included only where there is a figure.

    Args:
        title: what the page is about.
        source: the data it was made from.
        sections: from top to bottom.
    """
    figures = [f for s in sections for f in s.figures]
    script, divs = components(figures) if figures else ('', ())
    remaining = iter(divs)
    blocks = []
    for section in sections:
        plots = [next(remaining) for _ in section.figures]
        block = _templates().get_template(section.template)
        blocks.append(block.render(section.values, plots=plots))
    library = Resources(mode='inline', components=BOKEH_PARTS).render_js() if figures else ''
    page = _templates().get_template('page.html')
    return page.render(title=title, source=source, sections=blocks, library=library, script=script)


def _evidence(explanation: Explanation, recordings: Sequence[Recording]) -> list[Section]:
    """The sections that a finished search fills."""
    found, errors = explanation.search, explanation.errors
    assert found is not None
    curves = trace(recordings, found)
    robot = curves.model.robot
    return [
        budget.explained(errors),
        horizon.held_out(errors, repaired=bool(explanation.effects)),
        missing.section(curves.measured, robot, curves.candidates),
        hypotheses.section(
            explanation.effects,
            explanation.hypotheses,
            explanation.constants,
            found.rounds[0].threshold,
        ),
        where.section(curves.measured, curves.model),
        health.section(found, errors),
    ]


def _source(recordings: Sequence[Recording]) -> str:
    first, *others = recordings
    return f'{first.path.name} and {len(others)} more' if others else first.path.name


@cache
def _templates() -> jinja2.Environment:
    environment = jinja2.Environment(
        loader=jinja2.PackageLoader('leo_diffmodel.report'),
        autoescape=True,
        undefined=jinja2.StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
    )
    filters: dict[str, Any] = {
        'number': text.number,
        'percent': text.percent,
        'prose': text.prose,
        'quantity': text.quantity,
    }
    environment.filters.update(filters)
    environment.globals['palette'] = palette
    return environment


def _write(path: Path, html: str) -> None:
    path.parent.mkdir(parents=True, exist_ok=True)
    part = path.with_name(f'.{path.name}.part')
    part.write_text(html, encoding='utf-8')
    os.replace(part, path)
