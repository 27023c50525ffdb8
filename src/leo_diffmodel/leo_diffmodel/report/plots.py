# SPDX-License-Identifier: Apache-2.0
"""The figures of the page, all in one quiet style: light grid, units on both axes."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

from bokeh.models import ColumnDataSource, PrintfTickFormatter, Range1d, Span
import numpy as np

from leo_diffmodel.picture import palette
from leo_diffmodel.picture.palette import Stroke
from leo_diffmodel.report.binned import Binned, torque_canvas
from leo_diffmodel.report.canvas import canvas, hover, ticks

Array = np.ndarray


@dataclass(frozen=True)
class Line:
    """One curve over a shared abscissa: its name, values, stroke and width [px]."""

    name: str
    values: Any
    stroke: Stroke
    width: float = 2.5


def horizon(
    seconds: Sequence[float], lines: Sequence[Line], floor: Sequence[float], axis: str
) -> Any:
    """Error against prediction horizon, both logarithmic, with the noise floor shaded.

    Args:
        seconds: horizons [s].
        lines: error of each model.
        floor: what a perfect model would score.
        axis: label of the ordinate, with its unit.
    """
    plot = canvas('prediction horizon [s]', axis, x_axis_type='log', y_axis_type='log')
    values = np.concatenate([floor, *(line.values for line in lines)])
    bottom, top = 0.6 * np.nanmin(values), 1.6 * np.nanmax(values)
    plot.y_range = Range1d(bottom, top)
    plot.varea(seconds, bottom, floor, color=palette.NOISE_FILL)
    plot.line(seconds, floor, color=palette.NOISE, line_width=1.5, line_dash='dashed')
    for line in lines:
        source = ColumnDataSource({'x': seconds, 'y': line.values, 'floor': floor})
        look = {'color': line.stroke.colour, 'source': source}
        plot.line('x', 'y', line_width=line.width, line_dash=line.stroke.dash, **look)
        dots = plot.scatter('x', 'y', size=2 * line.width + 2, **look)
        hover(plot, dots, [(line.name, '@y{0.000e}'), ('floor', '@floor{0.000e}'), ('s', '@x')])
    plot.axis.formatter = PrintfTickFormatter(format='%g')
    plot.xaxis.ticker = ticks(min(seconds), max(seconds))
    plot.yaxis.ticker = ticks(bottom, top)
    return plot


def torque(
    variable: Array, measured: Array, curves: Sequence[Line], axis: str, of: str = 'N m'
) -> Any:
    """Missing torque against one variable: estimates, their binned mean and the candidates.

    Args:
        variable: abscissa of each window, shape (W,).
        measured: missing torque of each window [N m], shape (W,).
        curves: the same estimate if a candidate were true, shape (W,) each.
        axis: label of the abscissa, with its unit.
        of: unit of the torque.
    """
    binned = Binned.of(variable, measured, [line.values for line in curves], of)
    plot, means = torque_canvas(*binned.sources(), [line.stroke for line in curves])
    hover(plot, means, [('mean', f'@y{{0.000}} {binned.unit}'), (axis, '@x{0.000}')])
    binned.label(plot, axis)
    return plot


def health(
    time: Array, before: Array, after: Array, same: bool, borders: Sequence[float] = ()
) -> Any:
    """Squared whitened residual over its expected value, window by window in bag time.

    Args:
        time: middle of each window [s], several bags one after the other.
        before: ratio with the model as given.
        after: ratio with the repaired model.
        same: nothing was repaired, so that one series says it all.
        borders: where a further bag begins [s].
    """
    label = 'time, one bag after the other [s]' if borders else 'time in the bag [s]'
    plot = canvas(label, 'squared residual / expected [1]', y_axis_type='log')
    if not same:
        plot.scatter(time, before, size=4, color=palette.BEFORE, alpha=0.6)
    colour = palette.BEFORE if same else palette.AFTER
    dots = plot.scatter(time, after, size=4.5, color=colour, alpha=0.7)
    hover(plot, dots, [('bag time', '@x{0.00} s'), ('ratio', '@y{0.00}')])
    both = np.concatenate([after, after if same else before])
    bottom, top = 0.7 * min(both.min(), 1.0), 1.4 * max(both.max(), 1.0)
    plot.y_range = Range1d(bottom, top)
    plot.yaxis.formatter = PrintfTickFormatter(format='%g')
    plot.yaxis.ticker = ticks(bottom, top)
    for border in borders:
        plot.add_layout(Span(location=border, dimension='height', line_color=palette.GRID))
    span = [float(time.min()), float(time.max())]
    plot.line(span, [1, 1], color=palette.NOISE, line_dash='dashed', line_width=1.5)
    return plot
