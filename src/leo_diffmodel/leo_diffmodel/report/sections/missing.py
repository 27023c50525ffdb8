# SPDX-License-Identifier: Apache-2.0
"""The torque the model lacks against speed, angle and input, and what candidates make of it."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, TYPE_CHECKING

import numpy as np

from leo_diffmodel.compare.conditions import folded, TURN
from leo_diffmodel.compare.sizes import length_unit, torque_unit
from leo_diffmodel.compare.torque import MissingTorque
from leo_diffmodel.compare.where import FAR, STANDARD_ERRORS
from leo_diffmodel.report import palette
from leo_diffmodel.report.plots import Line, torque
from leo_diffmodel.report.section import Section
from leo_diffmodel.report.text import torque as in_print
from leo_sim.description.robot import Robot

if TYPE_CHECKING:
    from leo_diffmodel.report.torque_curves import Curve

Array = np.ndarray
MOST_JOINTS = 4
LABELS = {'voltage': 'voltage [V]', 'torque': 'commanded torque [N m]', 'position': 'goal [rad]'}


def section(missing: MissingTorque, robot: Robot, candidates: Sequence[Curve] = ()) -> Section:
    """Figures against speed, angle and input for each joint, those that lack most first.

    Args:
        missing: the estimate from the data.
        robot: whose joints and inputs they are.
        candidates: what each hypothesis says the estimate should be.
    """
    shown = _lacking(missing)
    figures: list[Any] = []
    rows = []
    for j in shown:
        seen = missing.seen[:, j]
        lines = _lines(candidates, j, seen)
        name, measured = robot.joint_names[j], missing.torque[seen, j]
        of = torque_unit(robot, name)
        new = [torque(v[seen], measured, lines, a, of) for a, v in _variables(missing, robot, j)]
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


def _lacking(missing: MissingTorque) -> list[int]:
    """Joints that lack more than noise, most first; the foremost where none does."""
    count = missing.seen.sum(axis=0)
    square = (missing.torque / missing.spread) ** 2
    if missing.carrying is not None:
        square = np.minimum(square, FAR)
    mean = square.sum(axis=0) / np.maximum(count, 1)
    order = [int(j) for j in np.argsort(-mean)]
    beyond = 1.0 + STANDARD_ERRORS * np.sqrt(2.0 / np.maximum(count, 1))
    return [j for j in order if mean[j] > beyond[j]][:MOST_JOINTS] or order[:1]


def _variables(missing: MissingTorque, robot: Robot, joint: int) -> list[tuple[str, Array]]:
    """Abscissae with their labels; the input only where the joint has one that changes."""
    name = robot.joint_names[joint]
    unit = length_unit(robot, name)
    place = _angle(name, missing.q[:, joint]) if unit == 'rad' else (
        f'{name} position [m]', missing.q[:, joint]
    )  # fmt: skip
    found = [(f'{name} speed [{unit}/s]', missing.dq[:, joint]), place]
    if joint in robot.actuated:
        values = missing.inputs[:, robot.actuated.index(joint)]
        if np.ptp(values) > 0:
            found.append((f'{name} {LABELS[robot.input]}', values))
    return found


def _angle(name: str, q: Array) -> tuple[str, Array]:
    """The angle, folded into one turn where the joint went around."""
    within = '' if np.ptp(q) <= TURN else ' within a turn'
    return f'{name} angle{within} [rad]', folded(q)


def _lines(candidates: Sequence[Curve], joint: int, seen: Array) -> list[Line]:
    return [
        Line(c.label, c.torque[seen, joint], stroke)
        for c, stroke in zip(candidates, palette.CANDIDATES, strict=False)
    ]
