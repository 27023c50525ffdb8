# SPDX-License-Identifier: Apache-2.0
"""What was left out: stretches that something else moved, effects that these data cannot test."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

from leo_diffmodel.bags.recording import Recording
from leo_diffmodel.outside.outside import share_outside, Stretch
from leo_diffmodel.report.page import Section
from leo_diffmodel.report.text import numbered, percent


def stretches(recordings: Sequence[Recording], found: Sequence[Stretch]) -> Section:
    numbers = numbered(recordings)
    rows = []
    for s in found:
        time = f'{max(0.0, s.begin):.1f} … {s.end:.1f}\u00a0s'
        rows.append({'bag': numbers[s.source], 'time': time, 'kind': s.kind, 'why': s.why})
    share, several = percent(share_outside(recordings, found)), len(recordings) > 1
    return Section('outside.html', {'share': share, 'rows': rows, 'several': several})


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
