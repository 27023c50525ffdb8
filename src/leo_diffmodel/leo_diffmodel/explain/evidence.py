# SPDX-License-Identifier: Apache-2.0
"""How sure a name is: rivals, the bootstrap over time blocks, and what is left unexplained."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from leo_diffmodel.explain.classes import Facts, same_thing
from leo_diffmodel.explain.fit import Fit
from leo_diffmodel.explain.scored import MARGIN_NATS, Scored
from leo_diffmodel.explain.search import Round

Array = np.ndarray
RIVAL_NATS = 15.0
DRAWS = 200


@dataclass(frozen=True)
class Rival:
    """A candidate that explains the data about as well as the named one.

    Attributes:
        scored: the rival.
        separable_nats: by how much the named one is ahead.
        why: the reason where both are the same thing in any data, else None.
    """

    scored: Scored
    separable_nats: float
    why: str | None


def rivals(step: Round, facts: Facts) -> tuple[Rival, ...]:
    """Everything within reach of the best candidate of a round, nearest first."""
    best, *others = step.scored
    found = []
    for other in others:
        if other.fit is None:
            continue
        behind = best.score - other.score
        why = same_thing(best.candidate, other.candidate, facts)
        if behind < RIVAL_NATS:
            found.append(Rival(other, behind, why if behind < MARGIN_NATS else None))
    return tuple(found)


def open_rivals(found: tuple[Rival, ...]) -> tuple[Rival, ...]:
    """The rivals that keep a name from being given: close, and not the same thing."""
    return tuple(r for r in found if r.separable_nats < MARGIN_NATS and r.why is None)


def inclusion(step: Round, facts: Facts, blocks: Array, seed: int = 0) -> float:
    """Share of block bootstraps in which the best candidate, or its class, still wins."""
    fitted = [s for s in step.scored if s.fit is not None]
    best = fitted[0].candidate
    ours = np.array([s.candidate == best or bool(same_thing(best, s.candidate, facts))
                     for s in fitted])  # fmt: skip
    gains = np.array([_block_gains(step.null, s.fit, blocks) for s in fitted])  # type: ignore[arg-type]
    price = np.array([s.price for s in fitted])
    count = gains.shape[1]
    draws = np.random.default_rng(seed).integers(0, count, (DRAWS, count))
    totals = gains[:, draws].sum(axis=-1) / fitted[0].dispersion - price[:, None]
    return float(ours[np.argmax(totals, axis=0)].mean())


def _block_gains(null: Fit, fitted: Fit, blocks: Array) -> Array:
    return np.bincount(blocks, weights=null.loss - fitted.loss)
