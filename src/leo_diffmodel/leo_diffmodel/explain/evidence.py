# SPDX-License-Identifier: Apache-2.0
"""How sure a name is: rivals, the bootstrap over time blocks, and what is left unexplained."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from leo_diffmodel.explain.classes import Facts, same_thing
from leo_diffmodel.explain.fit import Fit
from leo_diffmodel.explain.ranking import Round
from leo_diffmodel.explain.scored import away, MARGIN_NATS, NEUTRAL_SIGMAS, Scored

Array = np.ndarray
RIVAL_NATS = 15.0
DRAWS = 200
SEED = 0


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


def rivals(step: Round, facts: Facts, of: Scored | None = None) -> tuple[Rival, ...]:
    """Everything within reach of a candidate of a round (by default the best), nearest first.

    What held-out data confirm and is far ahead of it counts too.
    """
    mine = of or step.scored[0]
    found = []
    for other in step.scored:
        behind = mine.score - other.score
        if other is mine or other.fit is None or behind >= RIVAL_NATS:
            continue
        if (behind <= -RIVAL_NATS and not other.confirmed) or _is_limit(mine, other):
            continue
        why = same_thing(mine.candidate, other.candidate, facts) if behind < MARGIN_NATS else None
        found.append(Rival(other, behind, why))
    return tuple(found)


def open_rivals(found: tuple[Rival, ...]) -> tuple[Rival, ...]:
    """The rivals that keep a name from being given: close, and not the same thing."""
    return tuple(r for r in found if r.separable_nats < MARGIN_NATS and r.why is None)


def _is_limit(mine: Scored, other: Scored) -> bool:
    """Whether another effect comes to a simpler one only in the limit.

    A spring as weak as its rest is far is a constant torque: it explains as much, with one
    parameter more, and no parameter of it is surely there.
    """
    assert other.fit is not None
    more = len(other.candidate.parameters) > len(mine.candidate.parameters)
    return more and bool(away(other.fit, other.candidate).max() < NEUTRAL_SIGMAS)


def inclusion(step: Round, facts: Facts, blocks: Array, of: Scored | None = None) -> float:
    """Share of block bootstraps in which a candidate, or its class, comes out best.

    Args:
        step: the round.
        facts: what decides which candidates are one class.
        blocks: time block of each window, shape (W,).
        of: the candidate; by default the best one.
    """
    mine = (of or step.scored[0]).candidate
    fitted = [(s, s.fit) for s in step.scored if s.fit is not None]
    ours = [s.candidate == mine or bool(same_thing(mine, s.candidate, facts)) for s, _ in fitted]
    gains = np.array([_block_gains(step.null, fit, blocks) for _, fit in fitted])
    price = np.array([s.price for s, _ in fitted])
    count = gains.shape[1]
    draws = np.random.default_rng(SEED).integers(0, count, (DRAWS, count))
    totals = gains[:, draws].sum(axis=-1) / fitted[0][0].dispersion - price[:, None]
    return float(np.array(ours)[np.argmax(totals, axis=0)].mean())


def _block_gains(null: Fit, fitted: Fit, blocks: Array) -> Array:
    return np.bincount(blocks, weights=null.loss - fitted.loss)
