# SPDX-License-Identifier: Apache-2.0
"""Is what is left only noise? The residual in units of its expected size."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from leo_diffmodel.explain.engine import Search
from leo_diffmodel.explain.fit import Fit
from leo_diffmodel.explain.verdict import UNEXPLAINED_RATIO
from leo_diffmodel.report import palette
from leo_diffmodel.report.figures import health
from leo_diffmodel.report.palette import Stroke
from leo_diffmodel.report.section import Section
from leo_diffmodel.report.text import number, percent


def section(found: Search, errors: Mapping[str, Any]) -> Section:
    """Chi-squared ratio of every window against bag time, before and after."""
    windows = found.problem.windows
    time = windows.start + 0.5 * windows.dt.sum(axis=1)
    repaired = bool(found.final.hypothesis.candidates)
    plot = health(time, _ratio(found.null), _ratio(found.final), not repaired)
    legend = [('as given', Stroke(palette.BEFORE, 'points'))] if repaired else []
    last = ('repaired', Stroke(palette.AFTER, 'points'))
    values = {
        'ratio': number(errors['chi2_ratio']),
        'white': errors['chi2_ratio'] <= UNEXPLAINED_RATIO,
        'left': percent(errors['unexplained_share']),
        'repaired': repaired,
        'legend': [
            *legend,
            last if repaired else ('the model', Stroke(palette.BEFORE, 'points')),
            ('only noise', Stroke(palette.NOISE, 'dashed')),
        ],
    }
    return Section('health.html', values, (plot,))


def _ratio(fitted: Fit) -> np.ndarray:
    """Mean squared whitened residual of each window over its expected value, shape (W,)."""
    free = fitted.residual.shape[-1] - fitted.start.shape[-1]
    return (fitted.residual**2).sum(axis=-1) / free
