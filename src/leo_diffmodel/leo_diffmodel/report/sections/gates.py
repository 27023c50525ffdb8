# SPDX-License-Identifier: Apache-2.0
"""What decided: every gate with its value, and how far the named parameters may go."""

from __future__ import annotations

from collections.abc import Mapping
import math
from typing import Any

from leo_diffmodel.explain.select.search import Search
from leo_diffmodel.explain.settings import Gates, texts
from leo_diffmodel.report.page import Section
from leo_diffmodel.report.text import number, quantity, unit


def section(settings: Mapping[str, float | None], found: Search | None) -> Section:
    """All gates of explain.json by name, and the plausible range of each named parameter."""
    said = texts(Gates)
    values = {n: 'no limit' if value is None else f'{value:g}' for n, value in settings.items()}
    gates = [{'name': n, 'value': v, 'said': said.get(n, '')} for n, v in values.items()]
    return Section('gates.html', {'gates': gates, 'limits': _limits(found) if found else []})


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
