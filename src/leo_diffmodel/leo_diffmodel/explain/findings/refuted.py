# SPDX-License-Identifier: Apache-2.0
"""Whether `leo compare` would refute the choice: another set predicts held-out data better."""

from __future__ import annotations

import numpy as np
from scipy.special import stdtrit

from leo_diffmodel.explain.estimate.fitted import Fit
from leo_diffmodel.explain.findings.held_out import HeldOut
from leo_diffmodel.explain.problem.classes import Facts
from leo_diffmodel.explain.select.search import Search
from leo_diffmodel.explain.select.stable import holds

Array = np.ndarray
FEWEST = 3
"""Stretches of held-out time that tell how much an error varies."""
BY_CHANCE = 0.05
"""Share of right answers that chance may refute."""


def refuted(found: Search, held: HeldOut, facts: Facts) -> str:
    """The set with the surely smallest held-out error, in words; '' where the chosen one has it.

    Of sets that lack a chosen effect, by any name, and have one effect more at most. The error is
    that of `leo compare`: squared, so far ahead of the measured start. A set is better where the
    mean over stretches of time is surely below that of the chosen one (Student's t, with as
    many sets as are compared, Bonferroni).
    """
    chosen, floor = found.chosen.names, held.predict(found.final).floor.mean(axis=(0, 1))
    _, block = np.unique(found.posed.blocks.index(held.windows), return_inverse=True)
    if len(np.unique(block)) < FEWEST:
        return ''
    mine = _squares(held, found.final, floor)
    rivals = [s for s in found.sets if len(s.names) <= len(chosen) + 1
              and any(not holds(s.names, c, facts.alike) for c in chosen)]  # fmt: skip
    saved = {s.names: np.bincount(block, mine - _squares(held, s.fit, floor)) for s in rivals}
    least = stdtrit(block.max(), 1.0 - BY_CHANCE / max(len(rivals), 1))
    better = {names: float(by.sum()) for names, by in saved.items()
              if by.sum() > least * np.sqrt(len(by)) * by.std(ddof=1)}  # fmt: skip
    best = max(better, key=better.__getitem__, default=None)
    if best is None:
        return ''
    return ' + '.join(sorted(c.label for c in best)) or 'the model as given'


def _squares(held: HeldOut, fitted: Fit, floor: Array) -> Array:
    """Squared error of each window, mean over the states in units of their noise floor, (W,)."""
    square: Array = (held.ahead(fitted) ** 2 / floor).mean(axis=-1)
    return square
