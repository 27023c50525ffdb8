# SPDX-License-Identifier: Apache-2.0
"""Error against prediction horizon, state by state, over the floor of noise."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

from bokeh.models import ColumnDataSource, Range1d
import numpy as np

from leo_diffmodel.picture import palette
from leo_diffmodel.picture.palette import Stroke
from leo_diffmodel.report.canvas import canvas, hover, plain_numbers, ticks
from leo_diffmodel.report.page import Section

NOTE = (
    'Rms error of predictions that start from the measured state{} The shaded floor is what a '
    'perfect model would score on this bag: noise in the start state, carried along, and in the '
    'reading.'
)
HELD_OUT, PLAIN = ', on data that no fit has seen.', '; nothing was fitted.'
BELOW_FLOOR = 0.6
MOST_FIGURES = 6
"""Where there are more states, their rates are left to the JSON."""
THIN, WIDE = 1.5, 2.5
Row = Mapping[str, Any]
Series = Mapping[str, tuple[list[list[float]], Stroke]]
"""By name the errors of each state at each horizon, and how they are drawn."""
BEFORE, AFTER = Stroke(palette.BEFORE), palette.REPAIRED
DOTTED = 'dotted'
TRAINING = {'before': Stroke(palette.BEFORE, DOTTED), 'after': Stroke(palette.AFTER, DOTTED)}


def held_out(errors: Mapping[str, Any], repaired: bool, training: Sequence[Row] = ()) -> Section:
    """Before and after a repair; where nothing was repaired, the model alone.

    `errors` are those of explain.json, `training` rows of errors on the data that the fits saw.
    """
    keys = {'before': ('as given', BEFORE), 'after': ('repaired', AFTER)}
    if not repaired:
        keys = {'before': ('the model', BEFORE)}
    rows = errors['horizon']
    suffix = ', held out' if training else ''
    series: dict[str, tuple[list[list[float]], Stroke]] = {
        f'{n}{suffix}': ([r[k] for r in rows], stroke) for k, (n, stroke) in keys.items()
    }
    if training:
        series |= _training(rows, training, {k: name for k, (name, _) in keys.items()})
    floor = [r['noise_floor'] for r in rows]
    sure = errors['statistic'] == 'rmse'
    return _section(errors['states'], rows, series, floor, HELD_OUT, sure)


def _training(rows: Sequence[Row], seen: Sequence[Row], names: Mapping[str, str]) -> Series:
    """The errors on training data at the horizons of the held-out ones, where they reach."""
    at = {r['steps']: r for r in seen}
    none = [float('nan')] * len(rows[0]['before'])
    return {
        f'{name}, training': ([at.get(r['steps'], {}).get(k, none) for r in rows], TRAINING[k])
        for k, name in names.items()
    }


def plain(data: Mapping[str, Any]) -> Section:
    """The errors of compare.json."""
    floor = [r['rmse'] for r in data['noise_floor']['horizon']]
    series = {'the model': ([r['rmse'] for r in data['horizon']], BEFORE)}
    return _section(data['states'], data['horizon'], series, floor, PLAIN)


def _floor_too_high(series: Series, floor: list[list[float]]) -> bool:
    """Whether a model scores clearly better than a perfect one should be able to."""
    comparable = [errors for errors, stroke in series.values() if stroke.dash != DOTTED]
    best = np.min(comparable, axis=0)
    return bool((best < BELOW_FLOOR * np.array(floor)).any())


def _section(
    states: Sequence[Row],
    rows: Sequence[Row],
    series: Series,
    floor: list[list[float]],
    note: str,
    sure: bool = True,
) -> Section:
    """The figures; the floor is `sure` unless a few windows decide it, as on the ground."""
    seconds, figures = [r['seconds'] for r in rows], []
    for i, state in enumerate(states):
        if len(states) > MOST_FIGURES and state['name'].endswith(' rate'):
            continue
        curves = {n: ([row[i] for row in v], stroke) for n, (v, stroke) in series.items()}
        axis = f'rms error of {state["name"]} [{state["unit"]}]'
        figures.append(_figure(seconds, curves, [row[i] for row in floor], axis))
    values = {
        'legend': [
            *((n, stroke) for n, (_, stroke) in series.items()),
            ('noise floor', palette.FLOOR),
        ],
        'note': NOTE.format(note),
        'floor_too_high': sure and _floor_too_high(series, floor),
        'left_out': len(states) - len(figures),
    }
    return Section('horizon.html', values, tuple(figures))


def _figure(
    seconds: Sequence[float],
    curves: Mapping[str, tuple[list[float], Stroke]],
    floor: Sequence[float],
    axis: str,
) -> Any:
    """Error of each model against horizon [s], both logarithmic, with the noise floor shaded."""
    plot = canvas('prediction horizon [s]', axis, x_axis_type='log', y_axis_type='log')
    values = np.concatenate([floor, *(errors for errors, _ in curves.values())])
    bottom, top = 0.6 * np.nanmin(values), 1.6 * np.nanmax(values)
    plot.y_range = Range1d(bottom, top)
    plot.varea(seconds, bottom, floor, color=palette.NOISE_FILL)
    plot.line(seconds, floor, color=palette.NOISE, line_width=1.5, line_dash='dashed')
    for name, (errors, stroke) in curves.items():
        source = ColumnDataSource({'x': seconds, 'y': errors, 'floor': floor})
        look = {'color': stroke.colour, 'source': source}
        width = THIN if stroke.dash == DOTTED else WIDE
        plot.line('x', 'y', line_width=width, line_dash=stroke.dash, **look)
        dots = plot.scatter('x', 'y', size=2 * width + 2, **look)
        hover(plot, dots, [(name, '@y{0.000e}'), ('floor', '@floor{0.000e}'), ('s', '@x')])
    plain_numbers(plot.axis)
    plot.xaxis.ticker = ticks(min(seconds), max(seconds))
    plot.yaxis.ticker = ticks(bottom, top)
    return plot
