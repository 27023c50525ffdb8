# SPDX-License-Identifier: Apache-2.0
"""What decided, and how surely: gates, ranges of parameters, choices on parts of the data."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
import math
from typing import Any

from leo_diffmodel.explain.select.search import Search
from leo_diffmodel.explain.settings import Gates, texts
from leo_diffmodel.report.page import Section
from leo_diffmodel.report.text import label, number, percent, quantity, unit

MOST_SETS = 6


def gates(settings: Mapping[str, float | None], found: Search | None) -> Section:
    """All gates of explain.json by name, and the plausible range of each named parameter."""
    said = texts(Gates)
    values = {n: 'no limit' if value is None else f'{value:g}' for n, value in settings.items()}
    rows = [{'name': n, 'value': v, 'said': said.get(n, '')} for n, v in values.items()]
    return Section('gates.html', {'gates': rows, 'limits': _limits(found) if found else []})


def _limits(found: Search) -> list[dict[str, Any]]:
    final, rows = found.final, []
    for index, candidate in enumerate(final.hypothesis.candidates):
        first = final.hypothesis.offset(index)
        for i, p in enumerate(candidate.parameters):
            value = quantity(float(final.theta[first + i]), p.unit)
            ends = f'{_end(p.low)} … {_end(p.high)} {unit(p.unit)}'.rstrip()
            rows.append({'effect': candidate.label, 'name': p.name, 'value': value, 'range': ends})
    return rows


def _end(value: float) -> str:
    if math.isfinite(value):
        return number(value)
    return '∞' if value > 0 else '−∞'


def stability(
    rows: Sequence[Mapping[str, Any]],
    effects: Sequence[Mapping[str, Any]],
    settings: Mapping[str, float],
) -> Section:
    """A bar for each chosen set, the answer first, and a line for each of its effects."""
    others = rows[MOST_SETS:]
    sets = [
        _bar(' + '.join(r['effects']) or 'nothing is missing', r['share'], mine=n == 0)
        for n, r in enumerate(rows[:MOST_SETS])
    ]
    if others:
        sets.append(_bar(f'{len(others)} other sets', sum(r['share'] for r in others), mine=False))
    values = {
        'sets': sets,
        'effects': [_bar(label(e), e['inclusion_probability'], mine=True) for e in effects],
        'turns': settings['turns'],
        'left_out': percent(settings['left_out']),
        'stable': percent(settings['stable']),
        'at': 100 * settings['stable'],
    }
    return Section('stability.html', values)


def _bar(name: str, share: float, mine: bool) -> dict[str, Any]:
    return {'name': name, 'share': percent(share), 'width': 100 * share, 'mine': mine}
