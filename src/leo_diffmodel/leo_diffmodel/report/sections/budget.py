# SPDX-License-Identifier: Apache-2.0
"""Where the error goes: to each effect, to noise, and to what nobody explains."""

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from leo_diffmodel.picture import palette
from leo_diffmodel.report.page import Row, Section
from leo_diffmodel.report.text import percent, quantity

MOST_ACROSS = 6  # states that a table shows side by side
NOISE_ALONE = 1.2  # errors up to this many times the noise floor are put down to chance
WORDS = {'rmse': ('rms', 'mean squared error'), 'median': ('median', 'squared median error')}
"""By the figure that an answer is given in."""
NO_TABLE: dict[str, Any] = {'rows': []}


def explained(errors: Mapping[str, Any]) -> Section:
    """Shares of the held-out squared error of the model as given, from the ladder of models.

    Every state counts alike: its squared error is taken relative to that of the model as given,
    or to the noise where that is more, as in a state that the effect does not reach.
    """
    *models, noise = errors['ladder']
    kind = errors['statistic']
    word, squared = WORDS[kind]
    noise_square = np.array(noise[kind]) ** 2
    square = np.array([row[kind] for row in models]) ** 2
    whole = np.maximum(square[0], noise_square)
    whole = whole * (square[0] / whole).mean()
    share = (square / whole).mean(axis=1)
    gained = np.maximum(share[:-1] - share[1:], 0.0)
    floor = float((np.minimum(noise_square, square[-1]) / whole).mean())
    if np.mean(square[-1] / noise_square) < NOISE_ALONE**2:
        floor = float(share[-1])
    rest = max(float(share[-1]) - floor, 0.0)
    named = [
        _part(row['model'].removeprefix('+ '), g, palette.EFFECTS[i % len(palette.EFFECTS)])
        for i, (row, g) in enumerate(zip(models[1:], gained, strict=True))
    ]
    note = (
        f'Shares of the {squared} of the model as given, {noise["seconds"]:g} s ahead on '
        'held-out data; every state counts alike. Noise is what a perfect model would be charged, '
        f'and what exceeds it by less than {percent(NOISE_ALONE - 1)}, as chance does. What the '
        'answer says is something else is counted in the shorter windows of the fit, with starts '
        'that are free; it grows with the time ahead.'
    )
    table = {'word': word, **_table(errors['states'], errors['ladder'], kind)}
    return _section([*named, *_remainder(rest, floor)], 'Where the error goes', note, table)


def _table(states: Sequence[Row], ladder: Sequence[Row], kind: str) -> dict[str, Any]:
    models, names = [row['model'] for row in ladder], [state['name'] for state in states]
    units = [state['unit'] for state in states]
    cells = [[*map(quantity, row[kind], units)] for row in ladder]
    if len(names) > MOST_ACROSS:
        names, models, cells = models, names, [*map(list, zip(*cells, strict=True))]
    return {'heads': names, 'rows': [*zip(models, cells, strict=True)]}


def measured(budget: Mapping[str, float]) -> Section:
    parts = [
        _part('explained by the model', budget['explained'], palette.AFTER),
        *_remainder(budget['unexplained'], budget['noise']),
    ]
    note = 'Shares of the mean square of the motion within half a second; every state counts '
    note += 'alike. Noise is what a perfect model would be charged.'
    return _section(parts, 'How much of the motion the model explains', note, NO_TABLE)


def _remainder(unexplained: float, noise: float) -> list[dict[str, Any]]:
    rest = _part('unexplained', unexplained, palette.UNEXPLAINED)
    return [rest, _part('noise', noise, palette.NOISE)]


def _part(name: str, share: float, colour: str) -> dict[str, Any]:
    return {'name': name, 'share': float(share), 'colour': colour}


def _section(parts: list[dict[str, Any]], title: str, note: str, table: Row) -> Section:
    whole = max(sum(p['share'] for p in parts), 1e-12)
    bar = [{**p, 'width': 100 * p['share'] / whole} for p in parts if p['share'] > 0]
    values = {'title': title, 'note': note, 'bar': bar, 'parts': parts, **table}
    return Section('budget.html', values)
