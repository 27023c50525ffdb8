# SPDX-License-Identifier: Apache-2.0
"""What this data could not test: effects whose largest trace in it is below the threshold."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

from leo_diffmodel.report.page import Section


def section(not_testable: Sequence[Mapping[str, Any]]) -> Section:
    """Rows {name, where, why} of explain.json, one for each reason with its effects and places."""
    found: dict[str, dict[str, list[str]]] = {}
    for row in not_testable:
        found.setdefault(row['why'], {}).setdefault(row['name'], []).append(row['where'])
    rows = [
        {'why': why, 'effects': [{'name': n, 'where': w} for n, w in effects.items()]}
        for why, effects in found.items()
    ]
    return Section('untested.html', {'rows': rows})
