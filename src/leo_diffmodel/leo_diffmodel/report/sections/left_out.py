# SPDX-License-Identifier: Apache-2.0
"""What was left out: stretches that something else moved, effects that these data cannot test."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

from leo_diffmodel.bags.recording import Recording
from leo_diffmodel.outside.finding import Finding
from leo_diffmodel.outside.outside import share_outside
from leo_diffmodel.report.page import Section
from leo_diffmodel.report.text import numbered, percent


def stretches(recordings: Sequence[Recording], found: Sequence[Sequence[Finding]]) -> Section:
    """Every stretch found in each recording with its bag, times and reason."""
    both = zip(numbered(recordings), found, strict=False)
    values = {
        'share': percent(share_outside(recordings, found)),
        'rows': [_row(f, bag) for bag, each in both for f in each],
        'several': len(recordings) > 1,
    }
    return Section('outside.html', values)


def _row(stretch: Finding, bag: str) -> dict[str, str]:
    ((begin, end),) = stretch.where
    time = f'{max(0.0, begin):.1f} … {end:.1f}\u00a0s'
    return {'bag': bag, 'time': time, 'kind': stretch.code, 'why': stretch.what}


def effects(not_testable: Sequence[Mapping[str, Any]]) -> Section:
    """Rows {name, where, why} of explain.json, one for each reason with its effects and places."""
    found: dict[str, dict[str, list[str]]] = {}
    for row in not_testable:
        found.setdefault(row['why'], {}).setdefault(row['name'], []).append(row['where'])
    rows = [
        {'why': why, 'effects': [{'name': n, 'where': w} for n, w in places.items()]}
        for why, places in found.items()
    ]
    return Section('untested.html', {'rows': rows})
