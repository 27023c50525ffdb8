# SPDX-License-Identifier: Apache-2.0
"""Values of a fit with units and intervals, in the rows of explain.json and in words."""

from __future__ import annotations

import math

from leo_diffmodel.explain.estimate.fitted import Fit


def effect_row(fitted: Fit, index: int) -> dict:
    """Name, place, file and parameters of candidate `index`."""
    candidate = fitted.hypothesis.candidates[index]
    source = {'source': candidate.effect.source} if candidate.effect.source else {}
    return {
        'name': candidate.effect.name,
        'where': candidate.where,
        **source,
        'parameters': parameter_rows(fitted, index),
    }


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


def intervals(fitted: Fit, index: int) -> dict[str, tuple[float, float]]:
    """The 95 % confidence intervals of the parameters of candidate `index`."""
    first = fitted.hypothesis.offset(index)
    parameters = fitted.hypothesis.candidates[index].parameters
    return {p.name: fitted.ci95(first + i) for i, p in enumerate(parameters)}


def in_words(fitted: Fit, index: int) -> str:
    """The parameters of candidate `index` with units and intervals, as a sentence lists them."""
    rows = parameter_rows(fitted, index).items()
    return ', '.join(f'{name} = {_with_error(p)} {p["unit"]}'.rstrip() for name, p in rows)


def _with_error(parameter: dict) -> str:
    """A value with half its 95 % interval, both to the digit that the interval allows."""
    half = 0.5 * (parameter['ci95'][1] - parameter['ci95'][0])
    if not half > 0 or half > 10 * abs(parameter['value']):
        return f'{parameter["value"]:.3g}'
    digits = max(0, 1 - math.floor(math.log10(half)))
    if digits > 8:  # zeros that nobody counts
        figures = digits + 1 + math.floor(math.log10(max(abs(parameter['value']), half)))
        return f'{parameter["value"]:#.{figures}g} ± {half:#.2g}'
    return f'{parameter["value"]:.{digits}f} ± {half:.{digits}f}'
