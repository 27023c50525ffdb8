# SPDX-License-Identifier: Apache-2.0
"""Figures over time: the worst windows as measured and as predicted, and autocorrelation."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from bokeh.models import PrintfTickFormatter, Range1d
import numpy as np

from leo_diffmodel.picture import palette
from leo_diffmodel.report.canvas import canvas, hover
from leo_diffmodel.report.plots import Line

Array = np.ndarray
LOW = 230
BAND_SIGMAS = 2.0
MOST_DOTS = 100


def window(time: Array, measured: Array, lines: Sequence[Line], band: Array, axis: str) -> Any:
    """One stretch of a bag: measured, predicted, and what noise in the start leaves open.

    Args:
        time: bag time [s], shape (K+1,).
        measured: the state as measured, shape (K+1,).
        lines: predictions; the band is drawn about the last.
        band: standard deviation of the last prediction's error from noise alone, (K+1,).
        axis: label of the ordinate, with its unit.
    """
    plot = canvas('bag time [s]', axis, height=LOW)
    middle = np.asarray(lines[-1].values)
    low, high = middle - BAND_SIGMAS * band, middle + BAND_SIGMAS * band
    plot.varea(time, low, high, color=palette.NOISE_FILL)
    few = slice(None, None, -(-len(time) // MOST_DOTS))
    dots = plot.scatter(time[few], measured[few], size=4, color=palette.INK, line_color=None)
    hover(plot, dots, [('bag time', '@x{0.000} s'), ('measured', '@y{0.0000}')])
    for line in lines:
        plot.line(
            time, line.values, line_width=2.5, color=line.stroke.colour, line_dash=line.stroke.dash
        )
    plot.y_range = Range1d(*_room(measured, lines))
    return plot


def correlation(seconds: Array, lines: Sequence[Line], low: Array, high: Array, axis: str) -> Any:
    """Autocorrelation against lag, with the band that white noise would stay in.

    Args:
        seconds: lags [s], shape (L,).
        lines: of each joint.
        low: lower end of the 95 % band of white noise, the widest of the joints, shape (L,).
        high: its upper end.
        axis: label of the ordinate.
    """
    plot = canvas('lag [s]', axis, height=LOW)
    plot.varea(seconds, low, high, color=palette.NOISE_FILL)
    plot.line([seconds[0], seconds[-1]], [0, 0], color=palette.NOISE, line_width=1)
    for line in lines:
        look = {'color': line.stroke.colour}
        plot.line(seconds, line.values, line_width=2, line_dash=line.stroke.dash, **look)
        dots = plot.scatter(seconds, line.values, size=6, **look)
        hover(plot, dots, [(line.name, '@y{0.00}'), ('lag', '@x{0.000} s')])
    ends = np.concatenate([low, high, *(np.asarray(line.values) for line in lines)])
    plot.y_range = Range1d(min(-0.25, 1.1 * ends.min()), max(0.25, 1.1 * ends.max()))
    plot.xaxis.formatter = PrintfTickFormatter(format='%g')
    return plot


def _room(measured: Array, lines: Sequence[Line]) -> tuple[float, float]:
    """An ordinate for the curves; the band may reach beyond it."""
    ends = np.concatenate([measured, *(np.asarray(line.values) for line in lines)])
    margin = 0.08 * max(float(np.ptp(ends)), 1e-9)
    return float(ends.min() - margin), float(ends.max() + margin)
