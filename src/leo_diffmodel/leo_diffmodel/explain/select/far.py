# SPDX-License-Identifier: Apache-2.0
"""Which sets of effects another one surely predicts better than, far ahead of a measured state.

That is what a model is for. Short windows with free start states tell many laws apart by little,
and reward what follows the jitter of an input; a set that another one surely beats far ahead, with
one effect more at most, is no answer.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy.special import stdtrit

from leo_diffmodel.explain.select.names import Alike, holds, Names
from leo_diffmodel.explain.settings import Settings

Array = np.ndarray


@dataclass(frozen=True)
class Far:
    """Errors of sets far ahead of a measured state.

    Attributes:
        names: the sets.
        size: sum of `log_size` of each over each stretch of time, shape (S, B).
        count: windows in each stretch, shape (B,).
        fold: what is left out together with each stretch, shape (B,).
        settings: the gates.
        alike: whether two effects are one.
    """

    names: Sequence[Names]
    size: Array
    count: Array
    fold: Array
    settings: Settings
    alike: Alike

    def better(self, names: Names, folds: Array | None = None) -> list[Names]:
        """The sets that refute one: another answer, surely better; the best first.

        Args:
            names: the set.
            folds: those that count, shape (F,); None for all.
        """
        if names not in self.names:
            return []
        counts = slice(None) if folds is None else np.isin(self.fold, folds)
        mine = self.size[self.names.index(names), counts]
        saved = saved_surely(mine - self.size[:, counts], self.count[counts], self.settings)
        order = np.argsort(-saved)[: int((saved > 0).sum())]
        return [self.names[i] for i in order if another(self.names[i], names, self.alike)]


def another(rival: Names, names: Names, alike: Alike) -> bool:
    """Whether a set lacks an effect of one, by any name, and has one effect more at most."""
    return len(rival) <= len(names) + 1 and any(not holds(rival, c, alike) for c in names)


def log_size(errors: Array) -> Array:
    """Log of the size of errors (W, 2J) in noise floors, mean over the states, shape (W,).

    In logs no window, state or horizon speaks alone, and none below the noise speaks at all.
    """
    size: Array = 0.5 * np.log1p(errors**2).mean(axis=-1)
    return size


def saved_surely(saved: Array, count: Array, settings: Settings) -> Array:
    """What is saved in the mean of all windows, (S,); 0 where not surely, or a trifle.

    Args:
        saved: sum of what others save of a `log_size` in each stretch of time, shape (S, B).
        count: windows in each stretch, shape (B,).
        settings: the gates.
    """
    stretches, total = len(count), max(int(count.sum()), 1)
    if stretches < settings.fewest_blocks:
        return np.zeros(len(saved))
    mean = saved.sum(axis=-1) / total
    apart = saved - mean[:, None] * count
    error = np.sqrt((apart**2).sum(axis=-1) * stretches / (stretches - 1)) / total
    sure = mean > stdtrit(stretches - 1, settings.surely) * error
    return np.where(sure & (mean > 0.5 * np.log1p(settings.material)), mean, 0.0)
