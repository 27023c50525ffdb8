# SPDX-License-Identifier: Apache-2.0
"""How far the parameters of a named effect are from the hidden ones."""

from __future__ import annotations

import math

ANGLES = ('phase', 'rest')
"""Angles that shape an effect: their error counts in radians, all others' in their own size."""


def parameter_errors(hidden: dict, row: dict) -> list[dict]:
    """Rows {parameter, error, inside}: the relative error, and whether the 95 % interval holds it.

    Parameters of one unit, as the x and z of a force, are relative to their common size.

    Args:
        hidden: an effect of a case's truth.
        row: the effect in explain.json.
    """
    found, values = row['parameters'], dict(hidden['parameters'])
    if hidden['name'] == 'torque_ripple':
        values = _turned(values, found)
    return [
        {'parameter': f'{hidden["name"]}.{name}', 'error': error, 'inside': inside}
        for name, value in values.items()
        for error, inside in [_error(hidden, name, value, found[name])]
    ]


def _error(hidden: dict, name: str, value: float, found: dict) -> tuple[float, bool | None]:
    low, high = found.get('ci95') or (math.nan, math.nan)
    inside = low <= value <= high if low < high else None
    return abs(found['value'] - value) / max(_scale(hidden, name), 1e-12), inside


def _scale(hidden: dict, name: str) -> float:
    if name in ANGLES:
        return 1.0
    unit = hidden['units'][name]
    return math.hypot(
        *(
            hidden['parameters'][n] - hidden['neutral'][n]
            for n, u in hidden['units'].items()
            if u == unit and n not in ANGLES
        )
    )


def _turned(values: dict, found: dict) -> dict:
    """A ripple as it is, with the sign of the found one and the phase nearest to it."""
    amplitude, phase = values['a'], values['phase']
    if amplitude * found['a']['value'] < 0:
        amplitude, phase = -amplitude, phase + math.pi
    turns = round((found['phase']['value'] - phase) / (2 * math.pi))
    return {**values, 'a': amplitude, 'phase': phase + 2 * math.pi * turns}
