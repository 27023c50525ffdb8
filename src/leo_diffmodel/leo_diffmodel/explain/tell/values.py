# SPDX-License-Identifier: Apache-2.0
"""Parameters with units and intervals, as words."""

from __future__ import annotations

import math

from leo_diffmodel.explain.estimate.fitted import Fit
from leo_diffmodel.explain.estimate.rows import parameter_rows

MOST_DECIMALS = 8


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
    if digits > MOST_DECIMALS:
        figures = digits + 1 + math.floor(math.log10(max(abs(parameter['value']), half)))
        return f'{parameter["value"]:#.{figures}g} ± {half:#.2g}'
    return f'{parameter["value"]:.{digits}f} ± {half:.{digits}f}'
