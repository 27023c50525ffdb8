# SPDX-License-Identifier: Apache-2.0
"""What this data could not test: effects whose largest trace in it is below the threshold."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

from leo_diffmodel.report.page import Section


def section(not_testable: Sequence[Mapping[str, Any]]) -> Section:
    """Effects with their places and the reason.

    Args:
        not_testable: rows {name, where, why} of explain.json.
    """
    return Section('untested.html', {'rows': _by_reason(not_testable)})


def _by_reason(rows: Sequence[Mapping[str, Any]]) -> list[dict[str, Any]]:
    """Effects with one reason as one row: `effects` [{name, where: [...]}] and `why`."""
    found: dict[str, dict[str, list[str]]] = {}
    for row in rows:
        found.setdefault(row['why'], {}).setdefault(row['name'], []).append(row['where'])
    return [
        {'why': why, 'effects': [{'name': n, 'where': w} for n, w in effects.items()]}
        for why, effects in found.items()
    ]
