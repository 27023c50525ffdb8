# SPDX-License-Identifier: Apache-2.0
"""Error against prediction horizon, state by state, over the floor of noise."""

from collections.abc import Mapping, Sequence
from typing import Any

from bokeh.models import ColumnDataSource, FixedTicker, Range1d
import numpy as np

from leo_diffmodel.picture import palette
from leo_diffmodel.picture.palette import Stroke
from leo_diffmodel.report.canvas import canvas, hover, plain_numbers, ticks
from leo_diffmodel.report.page import models, Row, Section

NOTE = (
    'Rms error of predictions that start from the measured state{} The shaded floor is what a '
    'perfect model would score on this bag: noise in the start state, carried along, and in the '
    'reading.'
)
HELD_OUT, PLAIN = ', on data that no fit has seen.', '; nothing was fitted.'
BELOW_FLOOR = 0.6
MOST_FIGURES = 6  # where there are more states, their rates are left to the JSON
THIN, WIDE = 1.5, 2.5
LOWEST = 1e-12  # from where on the floor is shaded
Series = dict[str, tuple[list[list[float]], Stroke]]
"""By name the errors of each state at each horizon, and how they are drawn."""
BEFORE, AFTER = Stroke(palette.BEFORE), palette.REPAIRED
DOTTED = 'dotted'
TRAINING = {'before': Stroke(palette.BEFORE, DOTTED), 'after': Stroke(palette.AFTER, DOTTED)}


def held_out(errors: Mapping[str, Any], repaired: bool, training: Sequence[Row] = ()) -> Section:
    """Before and after a repair; where nothing was repaired, the model alone.

    `errors` are those of explain.json, `training` rows of errors on the data that the fits saw.
    """
    strokes = (BEFORE, AFTER) if repaired else (BEFORE,)
    keys = dict(zip(('before', 'after'), models(*strokes), strict=False))
    rows = errors['horizon']
    of = ', held out' if training else ''
    series: Series = {f'{n}{of}': ([r[k] for r in rows], look) for k, (n, look) in keys.items()}
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
    floor = [r['rmse'] for r in data['noise_floor']['horizon']]
    series = {'the model': ([r['rmse'] for r in data['horizon']], BEFORE)}
    return _section(data['states'], data['horizon'], series, floor, PLAIN)


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
    strokes = {name: stroke for name, (_, stroke) in series.items()}
    errors = {'floor': floor} | {name: of_model for name, (of_model, _) in series.items()}
    for i, state in enumerate(states):
        if len(states) > MOST_FIGURES and state['name'].endswith(' rate'):
            continue
        curves = {name: [row[i] for row in table] for name, table in errors.items()}
        plot = horizon_canvas(ColumnDataSource({'seconds': seconds, **curves}), strokes)
        low, high = np.nanmin([*curves.values()]), np.nanmax([*curves.values()])
        frame(plot, f'{state["name"]} [{state["unit"]}]', 0.6 * low, 1.6 * high)
        figures.append(plot)
    comparable = [errors for errors, stroke in series.values() if stroke.dash != DOTTED]
    below = (np.min(comparable, axis=0) < BELOW_FLOOR * np.array(floor)).any()
    values = {
        'legend': [*strokes.items(), ('noise floor', palette.FLOOR)],
        'note': NOTE.format(note),
        'floor_too_high': sure and bool(below),
        'left_out': len(states) - len(figures),
    }
    return Section('horizon.html', values, tuple(figures))


def horizon_canvas(source: ColumnDataSource, strokes: Mapping[str, Stroke], **options: Any) -> Any:
    """The columns of errors against `seconds`, both logarithmic, above the shaded `floor`."""
    scales = {'x_axis_type': 'log', 'y_axis_type': 'log', 'y_range': Range1d(1e-3, 1.0)}
    plot = canvas('prediction horizon [s]', '', **scales, **options)
    floor = {'source': source, 'color': palette.NOISE, 'line_dash': palette.FLOOR.dash}
    plot.varea('seconds', LOWEST, 'floor', source=source, color=palette.NOISE_FILL)
    plot.line('seconds', 'floor', line_width=1.5, **floor)
    for name, stroke in strokes.items():
        width = THIN if stroke.dash == DOTTED else WIDE
        look = {'color': stroke.colour, 'source': source}
        plot.line('seconds', name, line_width=width, line_dash=stroke.dash, **look)
        dots = plot.scatter('seconds', name, size=2 * width + 2, **look)
        tip = (name, f'@{{{name}}}{{0.000e}}')
        hover(plot, dots, [tip, ('floor', '@floor{0.000e}'), ('s', '@seconds')])
    plain_numbers(plot.axis)
    seconds = source.data['seconds']
    plot.xaxis.ticker, plot.yaxis.ticker = ticks(min(seconds), max(seconds)), FixedTicker()
    return plot


def frame(plot: Any, axis: str, bottom: float, top: float) -> None:
    """Say whose error a plot shows, and show it from `bottom` to `top`."""
    plot.yaxis.axis_label = f'rms error of {axis}'
    plot.y_range.update(start=bottom, end=top)
    plot.yaxis.ticker.ticks = ticks(bottom, top)
