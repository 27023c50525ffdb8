# SPDX-License-Identifier: Apache-2.0
"""How stable the answer is: which set is chosen when parts of the data take no part in it."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

from leo_diffmodel.report.page import Section
from leo_diffmodel.report.text import label, percent

MOST_SETS = 6


def section(
    rows: Sequence[Mapping[str, Any]],
    effects: Sequence[Mapping[str, Any]],
    settings: Mapping[str, float],
) -> Section:
    """A bar for each chosen set, the answer first, and a line for each of its effects.

    Rows are `stability` and `effects` of explain.json, settings the gates by name.
    """
    others = rows[MOST_SETS:]
    sets = [
        _bar(' + '.join(r['effects']) or 'nothing is missing', r['share'], mine=n == 0)
        for n, r in enumerate(rows[:MOST_SETS])
    ]
    if others:
        rest = sum(r['share'] for r in others)
        sets.append(_bar(f'{len(others)} other sets', rest, mine=False))
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
