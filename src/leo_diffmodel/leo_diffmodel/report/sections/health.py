# SPDX-License-Identifier: Apache-2.0
"""Is what is left only noise? The residual in units of its expected size, in time and by kind."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

from bokeh.models import PrintfTickFormatter, Range1d, Span
import numpy as np

from leo_diffmodel.compare.windows import Windows
from leo_diffmodel.explain.select.search import Search
from leo_diffmodel.picture import palette
from leo_diffmodel.picture.palette import Stroke
from leo_diffmodel.report.canvas import canvas, hover, LOW, ticks
from leo_diffmodel.report.page import Section
from leo_diffmodel.report.text import number, percent
from leo_diffmodel.report.whiteness import by_condition, chi_squared, Correlation, correlation

Array = np.ndarray


def section(found: Search, errors: Mapping[str, Any]) -> Section:
    """Chi-squared of every window against time, autocorrelation, and chi-squared by condition.

    Of `errors` of explain.json, `chi2_ratio` and `unexplained_share` are shown.
    """
    problem = found.problem
    most, repaired = problem.gates.unexplained, bool(found.final.hypothesis.candidates)
    time, borders = _in_a_row(problem.windows)
    white = correlation(problem, found.final)
    names = problem.base.robot.joint_names
    before = chi_squared(found.null) if repaired else None
    plot = _ratios(time, before, chi_squared(found.final), borders)
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
    noise = ('only noise', palette.FLOOR)
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


def _ratios(time: Array, before: Array | None, after: Array, borders: list[float]) -> Any:
    """Squared whitened residual over its expected value in each window, against its middle [s].

    One series where nothing was repaired; lines at the borders, where a further bag begins [s].
    """
    label = 'time, one bag after the other [s]' if borders else 'time in the bag [s]'
    plot = canvas(label, 'squared residual / expected [1]', y_axis_type='log')
    if before is not None:
        plot.scatter(time, before, size=4, color=palette.BEFORE, alpha=0.6)
    colour = palette.BEFORE if before is None else palette.AFTER
    dots = plot.scatter(time, after, size=4.5, color=colour, alpha=0.7)
    hover(plot, dots, [('bag time', '@x{0.00} s'), ('ratio', '@y{0.00}')])
    both = after if before is None else np.concatenate([after, before])
    bottom, top = 0.7 * min(both.min(), 1.0), 1.4 * max(both.max(), 1.0)
    plot.y_range = Range1d(bottom, top)
    plot.yaxis.formatter = PrintfTickFormatter(format='%g')
    plot.yaxis.ticker = ticks(bottom, top)
    for border in borders:
        plot.add_layout(Span(location=border, dimension='height', line_color=palette.GRID))
    span = [float(time.min()), float(time.max())]
    plot.line(span, [1, 1], color=palette.NOISE, line_dash='dashed', line_width=1.5)
    return plot


def _correlograms(white: Correlation, names: Sequence[str]) -> list[Any]:
    """One for the angles and one for the rates."""
    joints = len(names)
    return [
        _correlogram(white, names, slice(first, first + joints), f'autocorrelation, {label} [1]')
        for first, label in ((0, 'angle'), (joints, 'rate'))
    ]


def _correlogram(white: Correlation, names: Sequence[str], columns: slice, axis: str) -> Any:
    """A line for each joint against lag, and the widest band that white noise would stay in."""
    seconds, values = white.seconds, white.value[:, columns]
    low, high = white.low[:, columns].min(axis=1), white.high[:, columns].max(axis=1)
    plot = canvas('lag [s]', axis, height=LOW)
    plot.varea(seconds, low, high, color=palette.NOISE_FILL)
    plot.line([seconds[0], seconds[-1]], [0, 0], color=palette.NOISE, line_width=1)
    lines = list(zip(names, values.T, palette.CANDIDATES, strict=False))
    for name, line, stroke in lines:
        look = {'color': stroke.colour}
        plot.line(seconds, line, line_width=2, line_dash=stroke.dash, **look)
        dots = plot.scatter(seconds, line, size=6, **look)
        hover(plot, dots, [(name, '@y{0.00}'), ('lag', '@x{0.000} s')])
    ends = np.concatenate([low, high, *(line for _, line, _ in lines)])
    plot.y_range = Range1d(min(-0.25, 1.1 * ends.min()), max(0.25, 1.1 * ends.max()))
    plot.xaxis.formatter = PrintfTickFormatter(format='%g')
    return plot


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
