# SPDX-License-Identifier: Apache-2.0
"""Error against prediction horizon, state by state, over the floor of noise."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from leo_diffmodel.picture import palette
from leo_diffmodel.picture.palette import Stroke
from leo_diffmodel.report.page import Section
from leo_diffmodel.report.plots import horizon, Line

HELD_OUT = (
    'Rms error of predictions that start from the measured state, on data that no fit has seen. '
    'The shaded floor is what a perfect model would score on this bag: noise in the start state, '
    'carried along, and in the reading.'
)
PLAIN = (
    'Rms error of predictions that start from the measured state; nothing was fitted. The shaded '
    'floor is what a perfect model would score on this bag: noise in the start state, carried '
    'along, and in the reading.'
)
BELOW_FLOOR = 0.6
MOST_FIGURES = 6
"""Where there are more states, their rates are left to the JSON."""
THIN, WIDE = 1.5, 2.5
Row = Mapping[str, Any]
Series = Mapping[str, tuple[list[list[float]], Stroke]]
BEFORE = Stroke(palette.BEFORE, 'solid')
AFTER = Stroke(palette.AFTER, 'solid')
DOTTED = 'dotted'
TRAINING = {'before': Stroke(palette.BEFORE, DOTTED), 'after': Stroke(palette.AFTER, DOTTED)}


def held_out(errors: Mapping[str, Any], repaired: bool, training: Sequence[Row] = ()) -> Section:
    """Before and after a repair; where nothing was repaired, the model alone.

    Args:
        errors: of explain.json, held out.
        repaired: effects were added.
        training: the same rows on the data that the fits did see.
    """
    keys = {'before': ('as given', BEFORE), 'after': ('repaired', AFTER)}
    if not repaired:
        keys = {'before': ('the model', BEFORE)}
    rows = errors['horizon']
    suffix = ', held out' if training else ''
    series: dict[str, tuple[list[list[float]], Stroke]] = {
        f'{n}{suffix}': ([r[k] for r in rows], stroke) for k, (n, stroke) in keys.items()
    }
    if training:
        series |= _training(rows, training, {k: name for k, (name, _) in keys.items()})
    floor = [r['noise_floor'] for r in rows]
    sure = errors['statistic'] == 'rmse'
    return _section(errors['states'], _seconds(rows), series, floor, HELD_OUT, sure)


def _training(rows: Sequence[Row], seen: Sequence[Row], names: Mapping[str, str]) -> Series:
    """The errors on training data at the horizons of the held-out ones, where they reach."""
    at = {r['steps']: r for r in seen}
    none = [float('nan')] * len(rows[0]['before'])
    return {
        f'{name}, training': ([at.get(r['steps'], {}).get(k, none) for r in rows], TRAINING[k])
        for k, name in names.items()
    }


def plain(data: Mapping[str, Any]) -> Section:
    """The errors of compare.json."""
    floor = [r['rmse'] for r in data['noise_floor']['horizon']]
    series = {'the model': ([r['rmse'] for r in data['horizon']], BEFORE)}
    return _section(data['states'], _seconds(data['horizon']), series, floor, PLAIN)


def _floor_too_high(series: Series, floor: list[list[float]]) -> bool:
    """Whether a model scores clearly better than a perfect one should be able to."""
    comparable = [errors for errors, stroke in series.values() if stroke.dash != DOTTED]
    best = np.min(comparable, axis=0)
    return bool((best < BELOW_FLOOR * np.array(floor)).any())


def _seconds(rows: Sequence[Row]) -> list[float]:
    return [r['seconds'] for r in rows]


def _section(
    states: Sequence[Mapping[str, Any]],
    seconds: list[float],
    series: Series,
    floor: list[list[float]],
    note: str,
    sure: bool = True,
) -> Section:
    """The figures; the floor is `sure` unless a few windows decide it, as on the ground."""
    figures = [
        horizon(
            seconds,
            [
                Line(n, [row[i] for row in v], stroke, THIN if stroke.dash == DOTTED else WIDE)
                for n, (v, stroke) in series.items()
            ],
            [row[i] for row in floor],
            f'rms error of {state["name"]} [{state["unit"]}]',
        )
        for i, state in enumerate(states)
        if len(states) <= MOST_FIGURES or not state['name'].endswith(' rate')
    ]
    legend = [(name, stroke) for name, (_, stroke) in series.items()]
    values = {
        'legend': [*legend, ('noise floor', Stroke(palette.NOISE, 'dashed'))],
        'note': note,
        'floor_too_high': sure and _floor_too_high(series, floor),
        'left_out': len(states) - len(figures),
    }
    return Section('horizon.html', values, tuple(figures))
