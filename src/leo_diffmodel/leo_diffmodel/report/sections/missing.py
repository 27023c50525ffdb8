# SPDX-License-Identifier: Apache-2.0
"""The torque the model lacks against speed, angle and input, and what candidates make of it."""

from collections.abc import Mapping
from typing import Any

from bokeh.models import ColumnDataSource
import numpy as np

from leo_diffmodel.compare.sizes import torque_unit
from leo_diffmodel.compare.torque import MissingTorque
from leo_diffmodel.picture import palette
from leo_diffmodel.report.binned import Binned, lacking, torque_canvas, variables
from leo_diffmodel.report.canvas import hover
from leo_diffmodel.report.page import Section
from leo_diffmodel.report.text import torque
from leo_sim.description.robot import Robot

Curves = Mapping[str, np.ndarray]
NO_CURVES: Curves = {}


def section(missing: MissingTorque, robot: Robot, curves: Curves = NO_CURVES) -> Section:
    """Figures against speed, angle and input for each joint, those that lack most first.

    `curves` are what each hypothesis says the estimate should be [N m], shape (W, J).
    """
    shown = lacking(missing)
    figures: list[Any] = []
    rows = []
    for j in shown:
        new = _figures(missing, robot, j, curves)
        rows.append((robot.joint_names[j], len(figures), len(figures) + len(new)))
        figures += new
    length = float(np.median(missing.windows.dt.sum(axis=1)))
    values = {
        'legend': list(zip(curves, palette.CANDIDATES, strict=False)),
        'rows': rows,
        'milliseconds': round(1e3 * length),
        'noise': ', '.join(_noise(missing, robot, j, len(shown) > 1) for j in shown),
        'hidden': [n for j, n in enumerate(robot.joint_names) if j not in shown],
        'count': len(missing.time),
    }
    return Section('missing.html', values, tuple(figures))


def _figures(missing: MissingTorque, robot: Robot, joint: int, curves: Curves) -> list[Any]:
    seen, unit = missing.seen[:, joint], torque_unit(robot, robot.joint_names[joint])
    strokes, figures = palette.CANDIDATES[: len(curves)], []
    lines = [curve[seen, joint] for curve in curves.values()]
    for axis, values in variables(missing, robot, joint):
        binned = Binned.of(values[seen], missing.torque[seen, joint], lines, unit)
        sources = ColumnDataSource(binned.dots), ColumnDataSource(binned.means)
        plot, means = torque_canvas(*sources, strokes)
        hover(plot, means, [('mean', f'@y{{0.000}} {binned.unit}'), (axis, '@x{0.000}')])
        binned.label(plot, axis)
        figures.append(plot)
    return figures


def _noise(missing: MissingTorque, robot: Robot, joint: int, several: bool) -> str:
    name = robot.joint_names[joint]
    typical = float(np.median(missing.spread[missing.seen[:, joint], joint]))
    size = torque(typical, 2, torque_unit(robot, name))
    return f'± {size} at {name}' if several else f'± {size}'
