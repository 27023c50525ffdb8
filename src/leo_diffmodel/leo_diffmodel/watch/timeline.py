# SPDX-License-Identifier: Apache-2.0
"""Several bags on one axis of time, one after the other."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from leo_diffmodel.bags.recording import Recording

Array = np.ndarray


@dataclass(frozen=True)
class Timeline:
    """Where each recording lies on the axis.

    Attributes:
        names: of the recordings.
        first: first stamp of each in its bag [s], shape (R,).
        begin: where each begins on the axis [s], shape (R,).
        length: of all together [s].
    """

    names: tuple[str, ...]
    first: Array
    begin: Array
    length: float

    @classmethod
    def of(cls, recordings: Sequence[Recording]) -> Timeline:
        """Recordings one after the other."""
        first = np.array([float(r.episodes[0].t[0]) for r in recordings])
        lengths = [float(r.episodes[-1].t[-1]) for r in recordings] - first
        begin = np.concatenate([[0.0], np.cumsum(lengths)])
        names = tuple(r.path.name for r in recordings)
        return cls(names, first, begin[:-1], float(begin[-1]))

    def at(self, source: Array, time: Array) -> Array:
        """From bag times [s] to the axis; the shapes broadcast."""
        return np.asarray(time - self.first[source] + self.begin[source])

    def words(self, seconds: float) -> str:
        """A place on the axis, as bag and bag time."""
        source = int(np.searchsorted(self.begin, seconds, side='right')) - 1
        time = seconds - self.begin[source] + self.first[source]
        return f'{self.names[source]} {time:.2f} s'
