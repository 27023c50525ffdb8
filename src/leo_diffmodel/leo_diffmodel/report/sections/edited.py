# SPDX-License-Identifier: Apache-2.0
"""The edit test: the changed robot, predicted without what was named."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from leo_diffmodel.report.page import Section
from leo_diffmodel.report.text import quantity


def section(data: Mapping[str, Any]) -> Section:
    """A row for each model, a column for each state, and the noise floor below.

    Args:
        data: `edit_test` of explain.json.
    """
    rows = [_row(row['model'], row['rmse'], data) for row in data['models']]
    values = {
        'bags': data['bags'],
        'seconds': quantity(data['seconds'], 's', 2),
        'sentence': data['sentence'],
        'states': [state['name'] for state in data['states']],
        'rows': [*rows, _row('noise alone', data['models'][0]['noise_floor'], data)],
        'best': data['models'][0]['model'],
    }
    return Section('edited.html', values)


def _row(name: str, sizes: list[float], data: Mapping[str, Any]) -> dict[str, Any]:
    units = [state['unit'] for state in data['states']]
    cells = [quantity(size, unit, 2) for size, unit in zip(sizes, units, strict=True)]
    return {'name': name, 'cells': cells}
