# SPDX-License-Identifier: Apache-2.0
"""Is what is left only noise? The residual in units of its expected size, in time and by kind."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from leo_diffmodel.compare.windows import Windows
from leo_diffmodel.explain.select.search import Search
from leo_diffmodel.picture import palette
from leo_diffmodel.picture.palette import Stroke
from leo_diffmodel.report.page import Section
from leo_diffmodel.report.plots import health, Line
from leo_diffmodel.report.text import number, percent
from leo_diffmodel.report.traces import correlation as correlogram
from leo_diffmodel.report.whiteness import by_condition, chi_squared, Correlation, correlation

Array = np.ndarray


def section(found: Search, errors: Mapping[str, Any]) -> Section:
    """Chi-squared of every window against time, autocorrelation, and chi-squared by condition.

    Args:
        found: the finished search.
        errors: `chi2_ratio` and `unexplained_share` of explain.json's errors.
    """
    problem = found.problem
    most, repaired = problem.gates.unexplained, bool(found.final.hypothesis.candidates)
    time, borders = _in_a_row(problem.windows)
    white = correlation(problem, found.final)
    names = problem.base.robot.joint_names
    plot = health(time, chi_squared(found.null), chi_squared(found.final), not repaired, borders)
    values = {
        'certificate': found.final.certificate,
        'ratio': number(errors['chi2_ratio']),
        'on_ground': bool(problem.linearisation),
        'white': errors['chi2_ratio'] <= most,
        'left': percent(errors['unexplained_share']),
        'repaired': repaired,
        'legend': _legend(repaired),
        'correlated': not white.white,
        'strength': number(white.strength, 2),
        'joints': list(zip(names, palette.CANDIDATES, strict=False)) if len(names) > 1 else [],
        'conditions': _conditions(by_condition(problem, found.null, found.final), most),
        'many': len(names) > 1,
    }
    return Section('health.html', values, (plot, *_correlograms(white, names)))


def _legend(repaired: bool) -> list[tuple[str, Stroke]]:
    before, after = Stroke(palette.BEFORE, 'points'), Stroke(palette.AFTER, 'points')
    noise = ('only noise', Stroke(palette.NOISE, 'dashed'))
    if repaired:
        return [('as given', before), ('repaired', after), noise]
    return [('the model', before), noise]


def _in_a_row(windows: Windows) -> tuple[Array, list[float]]:
    """Time of each window with the bags one after the other, and where each later bag begins."""
    length = windows.dt.sum(axis=1)
    time = windows.start + 0.5 * length
    borders, at = [], 0.0
    shifted = np.empty_like(time)
    for bag in np.unique(windows.source):
        mine = windows.source == bag
        first = float(windows.start[mine].min())
        shifted[mine] = time[mine] - first + at
        borders.append(at)
        at += float((windows.start + length)[mine].max()) - first
    return (shifted, borders[1:]) if borders[1:] else (time, [])


def _correlograms(white: Correlation, names: Sequence[str]) -> list[Any]:
    """One for the angles and one for the rates, a line for each joint."""
    joints, figures = len(names), []
    for first, label in ((0, 'angle'), (joints, 'rate')):
        columns = slice(first, first + joints)
        lines = [
            Line(name, white.value[:, first + j], stroke)
            for j, (name, stroke) in enumerate(zip(names, palette.CANDIDATES, strict=False))
        ]
        low, high = white.low[:, columns].min(axis=1), white.high[:, columns].max(axis=1)
        axis = f'autocorrelation, {label} [1]'
        figures.append(correlogram(white.seconds, lines, low, high, axis))
    return figures


def _conditions(rows: Sequence[Mapping[str, Any]], most: float) -> list[dict[str, Any]]:
    return [
        {
            'joint': r['joint'],
            'variable': r['variable'],
            'range': _range(r),
            'windows': r['windows'],
            'before': number(r['before']),
            'after': number(r['after']),
            'bad': r['after'] > most,
        }
        for r in rows
    ]


def _range(row: Mapping[str, Any]) -> str:
    if isinstance(row['bin'], str):
        return row['bin']
    return ' … '.join(number(end, 2) for end in row['bin']) + f' {row["unit"]}'
