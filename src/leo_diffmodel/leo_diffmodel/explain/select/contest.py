# SPDX-License-Identifier: Apache-2.0
"""Settle close calls: hypotheses that short windows cannot part are fitted to longer ones."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from functools import partial

import numpy as np

from leo_diffmodel.explain.estimate import helper
from leo_diffmodel.explain.estimate.fit import Fit, fit, Problem
from leo_diffmodel.explain.select.scored import dispersion, MARGIN_NATS, Scored

MOST_RIVALS = 5


def contest(longer: Problem | None, scored: Sequence[Scored]) -> list[Scored]:
    """The candidates with `decider` set for those within reach of the best.

    Args:
        longer: the problem of longer windows; without it nothing changes.
        scored: fitted candidates of one round.
    """
    best = max(s.score for s in scored)
    near = [s for s in scored if best - s.score < MARGIN_NATS][:MOST_RIVALS]
    if longer is None or len(near) < 2:
        return list(scored)
    fits = helper.spread(partial(_fitted, longer), [s.fit for s in near if s.fit is not None])
    spread = min(dispersion(f) for f in fits)
    merit = np.array(
        [-f.loss[longer.train].sum() / spread - s.price for f, s in zip(fits, near, strict=True)]
    )
    behind = dict(zip((s.candidate for s in near), merit - merit.max(), strict=True))
    return [replace(s, decider=float(behind.get(s.candidate, 0.0))) for s in scored]


def _fitted(longer: Problem, short: Fit) -> Fit:
    return fit(longer, short.hypothesis, short.theta)
