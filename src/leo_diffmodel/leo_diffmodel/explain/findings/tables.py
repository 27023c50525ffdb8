# SPDX-License-Identifier: Apache-2.0
"""Held-out errors before, after and the floor of noise, one step and against horizon."""

from __future__ import annotations

import numpy as np

from leo_diffmodel.compare import errors
from leo_diffmodel.compare.errors import Prediction


def one_step(before: Prediction, after: Prediction, step: float) -> dict:
    """Root mean square errors of each state one control period ahead, and their mean."""
    early, late = (errors.one_step(p, step) for p in (before, after))
    return _beside(early['rmse'], late['rmse'], late['noise_floor']['rmse'])


def horizon(before: Prediction, after: Prediction, step: float) -> list[dict]:
    """The same further and further ahead."""
    tables = (errors.horizon_table(p, step) for p in (before, after))
    return [
        {'steps': b['steps'], 'seconds': b['seconds'],
         **_beside(b['rmse'], a['rmse'], a['noise_floor'])}
        for b, a in zip(*tables, strict=True)
    ]  # fmt: skip


def _beside(before: list[float], after: list[float], floor: list[float]) -> dict:
    figures = {'before': before, 'after': after, 'noise_floor': floor}
    return {**figures, 'mean': {name: float(np.mean(x)) for name, x in figures.items()}}
