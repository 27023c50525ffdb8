# SPDX-License-Identifier: Apache-2.0
"""What is missing and no known effect: the curve against its variable, and the formula."""

from typing import Any

from bokeh.models import ColumnDataSource
import numpy as np

from leo_diffmodel.explain.unknown.answer import Unknown
from leo_diffmodel.picture import palette
from leo_diffmodel.report.canvas import canvas, hover, points
from leo_diffmodel.report.page import Section
from leo_diffmodel.report.text import estimates, percent, prefix

QUANTITIES = {
    'torque': 'missing torque',
    'friction': 'missing friction',
    'drive': 'missing share of the motor torque',
}


def section(unknown: Unknown) -> Section:
    values = {
        'words': unknown.words.partition(':')[0],
        'formula': unknown.formula.partition(' with ')[0],
        'parameters': estimates(unknown.parameters) if unknown.fit else [unknown.formula],
        'r2': percent(unknown.r2_held_out),
        'gain_train': unknown.gain_train,
        'gain_held_out': unknown.gain_held_out,
        'source': unknown.source,
        'legend': [('the law', palette.REPAIRED)] if unknown.fit else [],
    }
    return Section('unknown.html', values, (_figure(unknown),))


def _figure(unknown: Unknown) -> Any:
    curve = unknown.curve
    y, half = np.array(curve['y'], dtype=float), np.array(curve['ci95'], dtype=float)
    scale, si = prefix(float(np.abs(y).max()))
    unit = f'{si}{curve["y_unit"]}' if curve['y_unit'] else '1'
    scale = scale if curve['y_unit'] else 1.0
    of = f' of {unknown.of}' if unknown.of else ''
    x_label = f'{unknown.variable}{of} [{curve["x_unit"] or "1"}]'
    plot = canvas(x_label, f'{QUANTITIES[unknown.acts_as]} [{unit}]')
    data = {'x': curve['x'], 'y': scale * y, 'low': scale * (y - half), 'high': scale * (y + half)}
    source = ColumnDataSource(data)
    if unknown.fit:
        height = scale * np.array(curve['law'], dtype=float)
        plot.line(curve['x'], height, line_width=3, color=palette.AFTER)
    dots = points(plot, source)
    hover(plot, dots, [(f'{unknown.variable}', '@x{0.000}'), ('missing', f'@y{{0.000}} {unit}')])
    return plot
