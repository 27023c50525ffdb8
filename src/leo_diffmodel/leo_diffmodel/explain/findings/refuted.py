# SPDX-License-Identifier: Apache-2.0
"""Whether `leo compare` would refute the choice: another set predicts held-out data better."""

from __future__ import annotations

import numpy as np
from scipy.special import stdtrit

from leo_diffmodel.explain.estimate.fitted import Fit
from leo_diffmodel.explain.findings.held_out import HeldOut
from leo_diffmodel.explain.problem.classes import Facts
from leo_diffmodel.explain.select.search import Search
from leo_diffmodel.explain.select.sets import Names
from leo_diffmodel.explain.select.stable import holds

Array = np.ndarray


def refuted(found: Search, held: HeldOut, facts: Facts) -> str:
    """The set with the surely smallest held-out error, in words; '' where the chosen one has it.

    Of sets that lack a chosen effect, by any name, and have one effect more at most. The error is
    that of `leo compare`: squared, so far ahead of the measured start. A set is better where it
    saves a good part of that (`material`), and surely over stretches of time (Student's t).
    """
    chosen, floor = found.chosen.names, held.predict(found.final).floor.mean(axis=(0, 1))
    _, block = np.unique(found.posed.blocks.index(held.windows), return_inverse=True)
    gates = found.weight.gates
    if len(np.unique(block)) < gates.fewest_blocks:
        return ''
    mine, least = _squares(held, found.final, floor), stdtrit(block.max(), gates.surely)
    better: dict[Names, float] = {}
    for rival in found.sets:
        lacks = any(not holds(rival.names, c, facts.alike) for c in chosen)
        if lacks and len(rival.names) <= len(chosen) + 1:
            saved = np.bincount(block, mine - _squares(held, rival.fit, floor))
            share, errors = saved.sum() / mine.sum(), np.sqrt(len(saved)) * saved.std(ddof=1)
            if share > gates.material and saved.sum() > least * errors:
                better[rival.names] = share
    best = max(better, key=better.__getitem__, default=None)
    if best is None:
        return ''
    return ' + '.join(sorted(c.label for c in best)) or 'the model as given'


def _squares(held: HeldOut, fitted: Fit, floor: Array) -> Array:
    """Squared error of each window, mean over the states in units of their noise floor, (W,)."""
    square: Array = (held.ahead(fitted) ** 2 / floor).mean(axis=-1)
    return square
