# SPDX-License-Identifier: Apache-2.0
"""The edit test: the changed robot, predicted without what was named."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from leo_diffmodel.report.page import Section
from leo_diffmodel.report.text import quantity


def section(data: Mapping[str, Any]) -> Section:
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
