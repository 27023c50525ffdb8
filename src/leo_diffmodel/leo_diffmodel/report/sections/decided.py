# SPDX-License-Identifier: Apache-2.0
"""What decided, how surely, and on what: gates, stability, the edit test, what was left out."""

from collections.abc import Mapping, Sequence
import math
from typing import Any

from leo_diffmodel.bags.recording import Recordings
from leo_diffmodel.explain.select.search import Search
from leo_diffmodel.explain.settings import Gates, texts
from leo_diffmodel.outside.finding import Finding
from leo_diffmodel.outside.outside import share_outside
from leo_diffmodel.report.page import Row, Section
from leo_diffmodel.report.text import label, number, numbered, percent, quantity, unit

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


def stability(rows: Sequence[Row], effects: Sequence[Row], settings: Row) -> Section:
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


def edit_test(data: Mapping[str, Any]) -> Section:
    """A row for each model of `edit_test`, a column for each state, and the noise floor below."""
    models = data['models']
    named = [(row['model'], row['rmse']) for row in models]
    named.append(('noise alone', models[0]['noise_floor']))
    units = [state['unit'] for state in data['states']]
    rows = [
        {'name': n, 'cells': [quantity(x, u, 2) for x, u in zip(sizes, units, strict=True)]}
        for n, sizes in named
    ]
    seconds, best = quantity(data['seconds'], 's', 2), models[0]['model']
    return Section('edited.html', {**data, 'seconds': seconds, 'rows': rows, 'best': best})


def left_out(recordings: Recordings, found: Sequence[Sequence[Finding]]) -> Section:
    both = zip(numbered(recordings), found, strict=False)
    values = {
        'share': percent(share_outside(recordings, found)),
        'rows': [_stretch(f, bag) for bag, each in both for f in each],
        'several': len(recordings) > 1,
    }
    return Section('outside.html', values)


def _stretch(found: Finding, bag: str) -> dict[str, str]:
    ((begin, end),) = found.where
    time = f'{max(0.0, begin):.1f} … {end:.1f}\u00a0s'
    return {'bag': bag, 'time': time, 'kind': found.code, 'why': found.what}


def untested(not_testable: Sequence[Mapping[str, Any]]) -> Section:
    """Rows {name, where, why} of explain.json, one for each reason with its effects and places."""
    found: dict[str, dict[str, list[str]]] = {}
    for row in not_testable:
        found.setdefault(row['why'], {}).setdefault(row['name'], []).append(row['where'])
    rows = [
        {'why': why, 'effects': [{'name': n, 'where': w} for n, w in places.items()]}
        for why, places in found.items()
    ]
    return Section('untested.html', {'rows': rows})
