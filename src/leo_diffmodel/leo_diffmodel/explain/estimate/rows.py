# SPDX-License-Identifier: Apache-2.0
"""Values of a fit with units and intervals, as the rows of explain.json have them."""

from __future__ import annotations

from leo_diffmodel.explain.estimate.fitted import Fit


def parameter_rows(fitted: Fit, index: int) -> dict:
    """Value, unit and 95 % interval of each parameter of candidate `index`, by name."""
    first = fitted.hypothesis.offset(index)
    return {
        p.name: {
            'value': float(fitted.theta[first + i]),
            'unit': p.unit,
            'ci95': list(fitted.ci95(first + i)),
        }
        for i, p in enumerate(fitted.hypothesis.candidates[index].parameters)
    }


def constant_rows(fitted: Fit) -> dict[str, dict]:
    """Value, unit and 95 % interval of each refitted constant, by path.

    Of one that recordings have of their own it is their mean and all that their intervals span,
    and in `recordings` each of them by name.
    """
    first = fitted.hypothesis.size - len(fitted.hypothesis.constants)
    rows: dict[str, dict] = {}
    for i, c in enumerate(fitted.hypothesis.constants, first):
        row = {'value': float(fitted.theta[i]), 'unit': c.unit, 'ci95': list(fitted.ci95(i))}
        if c.recording:
            rows.setdefault(c.path, {'recordings': {}})['recordings'][c.recording] = row
        else:
            rows[c.path] = row
    return {path: _over_recordings(row) for path, row in rows.items()}


def _over_recordings(row: dict) -> dict:
    if 'recordings' not in row:
        return row
    each = list(row['recordings'].values())
    low, high = zip(*(r['ci95'] for r in each), strict=True)
    mean = sum(r['value'] for r in each) / len(each)
    return {'value': mean, 'unit': each[0]['unit'], 'ci95': [min(low), max(high)], **row}
