# SPDX-License-Identifier: Apache-2.0
"""The torque the model lacks against speed, angle and input, and what candidates make of it."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, TYPE_CHECKING

import numpy as np

from leo_diffmodel.compare.sizes import torque_unit
from leo_diffmodel.compare.torque import MissingTorque
from leo_diffmodel.picture import palette
from leo_diffmodel.report.lacking import lacking, variables
from leo_diffmodel.report.page import Section
from leo_diffmodel.report.plots import Line, torque
from leo_diffmodel.report.text import torque as in_print
from leo_sim.description.robot import Robot

if TYPE_CHECKING:
    from leo_diffmodel.report.torque_curves import Curve

Array = np.ndarray


def section(missing: MissingTorque, robot: Robot, candidates: Sequence[Curve] = ()) -> Section:
    """Figures against speed, angle and input for each joint, those that lack most first.

    Args:
        missing: the estimate from the data.
        robot: whose joints and inputs they are.
        candidates: what each hypothesis says the estimate should be.
    """
    shown = lacking(missing)
    figures: list[Any] = []
    rows = []
    for j in shown:
        seen = missing.seen[:, j]
        lines = _lines(candidates, j, seen)
        name, measured = robot.joint_names[j], missing.torque[seen, j]
        of = torque_unit(robot, name)
        new = [torque(v[seen], measured, lines, a, of) for a, v in variables(missing, robot, j)]
        rows.append((name, len(figures), len(figures) + len(new)))
        figures += new
    length = float(np.median(missing.windows.dt.sum(axis=1)))
    values = {
        'legend': list(zip([c.label for c in candidates], palette.CANDIDATES, strict=False)),
        'rows': rows,
        'milliseconds': round(1e3 * length),
        'noise': ', '.join(_noise(missing, robot, j, len(shown) > 1) for j in shown),
        'hidden': [n for j, n in enumerate(robot.joint_names) if j not in shown],
        'count': len(missing.time),
    }
    return Section('missing.html', values, tuple(figures))


def _noise(missing: MissingTorque, robot: Robot, joint: int, several: bool) -> str:
    name = robot.joint_names[joint]
    typical = float(np.median(missing.spread[missing.seen[:, joint], joint]))
    size = in_print(typical, 2, torque_unit(robot, name))
    return f'± {size} at {name}' if several else f'± {size}'


def _lines(candidates: Sequence[Curve], joint: int, seen: Array) -> list[Line]:
    return [
        Line(c.label, c.torque[seen, joint], stroke)
        for c, stroke in zip(candidates, palette.CANDIDATES, strict=False)
    ]
