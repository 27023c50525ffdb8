# SPDX-License-Identifier: Apache-2.0
"""Where the model fails: joint by joint, by angle, rate, input and time."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from leo_diffmodel.compare.torque import MissingTorque
from leo_diffmodel.compare.torque import where as worst_places
from leo_diffmodel.report.section import Section
from leo_diffmodel.report.text import number, percent, quantity
from leo_sim.model import Model

UNITS = {'angle': 'rad', 'rate': 'rad/s', 'time': 's'}
WORST = 6
MOST_ROWS = 16
WINDOWS = 3
FULL = 0.6
Row = Mapping[str, Any]


def section(missing: MissingTorque, model: Model) -> Section:
    """A heat map of joints and variables, and the worst stretches with their bag times.

    Args:
        missing: the missing torque, window by window.
        model: the model it is missing from.
    """
    rows = worst_places(missing, model)
    units = {**UNITS, 'input': 'V' if model.robot.input == 'voltage' else 'N m'}
    groups: dict[tuple[str, str], list[Row]] = {}
    for row in rows:
        groups.setdefault((row['joint'], row['variable']), []).append(row)
    shown = sorted(groups, key=lambda g: -max(r['share'] for r in groups[g]))[:MOST_ROWS]
    values = {
        'noise_only': _noise_only(missing),
        'map': [_strip(groups[g], units) for g in shown],
        'worst': [_worst(r, units) for r in rows[:WORST]],
        'hidden': len(groups) - len(shown),
    }
    return Section('where.html', values)


def _noise_only(missing: MissingTorque) -> bool:
    """Whether the torques are no larger than their own noise, at four standard errors."""
    square = (missing.torque / missing.spread) ** 2
    return float(square.mean()) < 1.0 + 4.0 * np.sqrt(2.0 / square.size)


def _strip(rows: Sequence[Row], units: Mapping[str, str]) -> dict[str, Any]:
    ordered = sorted(rows, key=lambda r: r['bin'][0])
    variable = ordered[0]['variable']
    return {
        'name': f'{ordered[0]["joint"]} {variable}',
        'unit': units[variable],
        'cells': [
            {
                'share': percent(r['share']),
                'shade': round(min(r['share'] / FULL, 1.0), 3),
                'low': number(r['bin'][0], 2),
                'high': number(r['bin'][1], 2),
            }
            for r in ordered
        ],
    }


def _worst(row: Row, units: Mapping[str, str]) -> dict[str, Any]:
    low, high = row['bin']
    variable = row['variable']
    return {
        'what': f'{row["joint"]} {variable}',
        'range': f'{number(low)} … {quantity(high, units[variable])}',
        'share': percent(row['share']),
        'torque': quantity(row['torque_rms_nm'], 'N m'),
        'volts': quantity(row['volts'], 'V') if row['volts'] is not None else '–',
        'stall': _of_stall(row['stall_percent']),
        'windows': ', '.join(f'{t0:.2f}' for t0, _ in row['windows'][:WINDOWS]) + ' s',
    }


def _of_stall(value: float | None) -> str:
    return '–' if value is None else percent(value / 100)
