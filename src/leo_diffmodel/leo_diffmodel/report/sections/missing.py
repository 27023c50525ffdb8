# SPDX-License-Identifier: Apache-2.0
"""The torque the model lacks against speed and angle, and what the candidates make of it."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from leo_diffmodel.compare.torque import MissingTorque
from leo_diffmodel.report import palette
from leo_diffmodel.report.figures import Line, torque
from leo_diffmodel.report.section import Section
from leo_diffmodel.report.torque_curves import Curve

MOST_JOINTS = 4


def section(
    missing: MissingTorque, joints: Sequence[str], candidates: Sequence[Curve] = ()
) -> Section:
    """Two figures for each joint, those that lack most first.

    Args:
        missing: the estimate from the data.
        joints: joint names.
        candidates: what each hypothesis says the estimate should be.
    """
    lack = np.sqrt(np.median(missing.torque**2, axis=0))
    shown = [int(j) for j in np.argsort(-lack)[:MOST_JOINTS]]
    strokes = palette.CANDIDATES
    figures = []
    for j in shown:
        lines = [
            Line(c.label, c.torque[:, j], s) for c, s in zip(candidates, strokes, strict=False)
        ]
        for values, name in ((missing.dq, 'speed [rad/s]'), (missing.q, 'angle [rad]')):
            axis = f'{joints[j]} {name}'
            figures.append(torque(values[:, j], missing.torque[:, j], lines, axis))
    length = float(np.median(missing.windows.dt.sum(axis=1)))
    values = {
        'legend': [(c.label, s) for c, s in zip(candidates, strokes, strict=False)],
        'names': [joints[j] for j in shown for _ in range(2)],
        'milliseconds': round(1e3 * length),
        'noise': float(np.median(missing.spread)),
        'hidden': len(joints) - len(shown),
        'count': len(missing.time),
    }
    return Section('missing.html', values, tuple(figures))
