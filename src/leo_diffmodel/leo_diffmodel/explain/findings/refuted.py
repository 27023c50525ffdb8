# SPDX-License-Identifier: Apache-2.0
"""Whether `leo compare` would refute the choice: a smaller set predicts held-out data better."""

from __future__ import annotations

import numpy as np

from leo_diffmodel.explain.estimate.fitted import Fit
from leo_diffmodel.explain.findings.held_out import HeldOut
from leo_diffmodel.explain.select.evidence import Scored
from leo_diffmodel.explain.select.search import Search

Array = np.ndarray


def refuted(found: Search, held: HeldOut) -> str:
    """The set of no more effects with the surely smallest held-out error, in words; '' for none.

    The error is that of `leo compare`: squared, so far ahead of the measured start. A set is
    better where the sum over stretches of time is so many times its standard error.
    """
    chosen, floor = len(found.chosen.names), held.predict(found.final).floor.mean(axis=(0, 1))
    block = found.posed.blocks.index(held.windows)
    mine = _squares(held, found.final, floor)
    least = found.weight.settings.refuting_errors
    better: list[tuple[float, Scored]] = []
    for rival in found.sets:
        if len(rival.names) <= chosen and rival.names != found.chosen.names:
            saved = np.bincount(block - block.min(), mine - _squares(held, rival.fit, floor))
            saved = saved[np.unique(block - block.min())]
            if saved.sum() > least * np.sqrt(len(saved)) * saved.std(ddof=1):
                better.append((float(saved.sum()), rival))
    if not better:
        return ''
    names = max(better, key=lambda b: b[0])[1].names
    return ' + '.join(sorted(c.label for c in names)) or 'the model as given'


def _squares(held: HeldOut, fitted: Fit, floor: Array) -> Array:
    """Squared error of each window, mean over the states in units of their noise floor, (W,)."""
    square: Array = (held.ahead(fitted) ** 2 / floor).mean(axis=-1)
    return square
