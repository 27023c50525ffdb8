# SPDX-License-Identifier: Apache-2.0
"""The outcome of one step of the search: all candidates on top of one hypothesis, ranked."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from leo_diffmodel.explain.estimate.fit import Fit
from leo_diffmodel.explain.estimate.hypothesis import Candidate
from leo_diffmodel.explain.estimate.scan import Scan
from leo_diffmodel.explain.estimate.shooting import robust_weight
from leo_diffmodel.explain.problem.pose import Posed
from leo_diffmodel.explain.select.contest import contest
from leo_diffmodel.explain.select.scored import away, dispersion, MARGIN_NATS, Scored

Array = np.ndarray
EQUAL_NATS = 1.0
WINDOW_NATS = 6.0
"""Most that one window on the ground may say, for a dispersion of 1: a contact there may flip."""


@dataclass(frozen=True)
class Round:
    """One step of the search: all candidates on top of one hypothesis.

    Attributes:
        null: the fit the candidates were added to.
        scored: best first.
        threshold: gain [nats] that noise alone can give.
        posed: the problem with the noise used here.
    """

    null: Fit
    scored: tuple[Scored, ...]
    threshold: float
    posed: Posed

    def of(self, candidate: Candidate) -> Scored:
        """A candidate of this round."""
        return next(s for s in self.scored if s.candidate == candidate)

    @property
    def best(self) -> Scored | None:
        """The best candidate that the data support, if any."""
        if not self.scored or self.scored[0].fit is None:
            return None
        top = self.scored[0]
        return top if top.total > self.threshold and top.confirmed else None


def gain(null: Fit, other: Fit, chosen: Array, spread: float = np.inf) -> float:
    """Robust loss saved on the chosen windows [nats].

    Args:
        null: the fit it is saved from.
        other: the fit that saves it.
        chosen: windows, shape (W,).
        spread: dispersion of the residuals, which limits what a window may say on the ground.
    """
    most = WINDOW_NATS * spread
    return float(np.clip(null.loss - other.loss, -most, most)[chosen].sum())


def gains(null: Fit, others: Sequence[Fit], chosen: Array, spread: float) -> list[float]:
    """What each of several fits saves [nats], as `gain`.

    Where a window may say so much only, all may save the most in all windows. They are compared
    with one another then: each saves what the best of them does, less what it is behind that.
    """
    if not np.isfinite(spread):
        return [gain(null, f, chosen) for f in others]
    best = others[0]
    for f in others[1:]:
        best = f if gain(best, f, chosen, spread) > 0 else best
    most = gain(null, best, chosen, spread)
    return [most - gain(f, best, chosen, spread) for f in others]


def ranking(
    posed: Posed,
    null: Fit,
    scans: Sequence[Scan],
    leading: Sequence[Fit],
    limit: float,
    candidates: Sequence[Candidate],
) -> Round:
    """The round in which the first of the scans led to the fits `leading`."""
    spread = min(dispersion(f) for f in leading)
    train, limited = posed.problem.train, spread if posed.problem.footing else np.inf
    saved = zip(*(gains(null, leading, c, limited) for c in (train, ~train)), strict=True)
    scored = []
    for s, f, (trained, held) in zip(scans, leading, saved, strict=False):
        promised = trained * held_out_share(null, f, train, WINDOW_NATS * limited)
        scored.append(Scored(s.candidate, f, trained, held, s.evidence, promised, spread))
    if posed.problem.footing:
        scored = [replace(s, away=float(away(f, f.hypothesis.candidates[-1]).max()))
                  for s, f in zip(scored, leading, strict=True)]  # fmt: skip
    if max(s.total for s in scored) > limit:
        scored = contest(posed.longer, scored)
    out = [
        Scored(s.candidate, None, s.gain, 0.0, s.evidence, dispersion=spread)
        for s in scans[len(leading) :]
    ]
    return Round(null, (*_ranked(scored, candidates), *out), limit, posed)


def _ranked(scored: Sequence[Scored], candidates: Sequence[Candidate]) -> list[Scored]:
    """Best first by training score, those that held-out data refute behind the others.

    What training cannot separate, held-out data may; of what nothing can, the first in the
    catalogue leads.
    """
    ranked = sorted(scored, key=lambda s: (not s.confirmed, -s.score))
    leader = ranked[0]
    margin = MARGIN_NATS * leader.dispersion
    tied = [
        s
        for s in ranked
        if leader.score - s.score < MARGIN_NATS
        and s.gain_held_out - leader.gain_held_out > margin
    ]
    equal = [
        s
        for s in ranked
        if leader.score - s.score < EQUAL_NATS and s.confirmed == leader.confirmed
    ]
    first = min(equal, key=lambda s: candidates.index(s.candidate))
    if tied:
        first = max(tied, key=lambda s: s.gain_held_out)
    return [first, *(s for s in ranked if s is not first)]


def held_out_share(null: Fit, fitted: Fit, train: Array, most: float) -> float:
    """How much of what a fit saves on the training windows it should save on the others.

    That is by how much it changes the prediction there, each window up to `most` nats.
    """
    weight = robust_weight(null.residual)
    trace = 0.5 * (weight * (null.residual - fitted.residual) ** 2).sum(axis=-1)
    trace = np.minimum(trace, most)
    return float(trace[~train].sum() / max(trace[train].sum(), 1e-12))
