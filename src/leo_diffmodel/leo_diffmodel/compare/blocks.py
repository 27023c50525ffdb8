# SPDX-License-Identifier: Apache-2.0
"""Blocks of time: what is held out and resampled together, as errors near in time are alike."""

from dataclasses import dataclass

import numpy as np

from leo_diffmodel.bags.recording import Recording, Recordings
from leo_diffmodel.compare.settings import COMPARE
from leo_diffmodel.compare.windows import Array, Windows


@dataclass(frozen=True)
class Blocks:
    """Numbered stretches of time over several recordings."""

    begin: Array  # first stamp of each recording [s], shape (R,)
    length: Array  # block length in each recording [s], shape (R,)
    offset: Array
    """Number of the first block of each recording, shape (R,). Recordings are numbered by their
    names, so that what is held out does not depend on how they were listed."""
    held_sources: tuple[int, ...] = ()
    """Recordings held out whole; where there are none, every fourth block is."""
    own: bool = False
    """Recordings held out have constants of their own, which are fitted on every other block of
    theirs; the rest of them is held out."""

    def index(self, windows: Windows, at: float = 0.0) -> Array:
        """Block of each window's instant `at` (0 its first sample, 1 its last), shape (W,)."""
        time = windows.start + at * windows.dt.sum(axis=1) - self.begin[windows.source]
        number = np.floor(time / self.length[windows.source] + 1e-9).astype(int)
        return self.offset[windows.source] + number

    def held(self, windows: Windows) -> Array:
        """Which windows lie wholly in held-out data, shape (W,)."""
        if self.held_sources:
            whole = self._whole(windows)
            return whole & self._every_other(windows, 1) if self.own else whole
        first, last = self.index(windows), self.index(windows, 1.0)
        return (first == last) & (first % COMPARE.held_out_every == COMPARE.first_held)

    def telling(self, windows: Windows) -> Array:
        """Which windows say what constants of their own held-out recordings have, (W,)."""
        return self._whole(windows) & self._every_other(windows, 0)

    def _whole(self, windows: Windows) -> Array:
        return np.isin(windows.source, self.held_sources)

    def _every_other(self, windows: Windows, which: int) -> Array:
        """Which windows lie wholly in the first, third, … block (0) or the others (1), (W,)."""
        first, last = self.index(windows), self.index(windows, 1.0)
        return (first == last) & ((first - self.offset[windows.source]) % 2 == which)

    def held_share(self, recordings: Recordings) -> float:
        """Which part of the recordings, by time, is held out."""
        if not self.held_sources:
            return 1.0 / COMPARE.held_out_every
        seconds = [sum(e.seconds for e in r.episodes) for r in recordings]
        return sum(seconds[i] for i in self.held_sources) / sum(seconds)

    def folds(self, windows: Windows) -> Array:
        """What is left out together when a prediction is judged: numbers from 0, shape (W,).

        A recording each where there are several, else neighbouring blocks of one.
        """
        sources = np.unique(windows.source[self.train(windows)])
        if len(sources) >= COMPARE.many_recordings:
            return np.searchsorted(np.sort(self.offset), self.offset[windows.source])
        _, number = np.unique(self.index(windows), return_inverse=True)
        count = int(number.max(initial=0)) + 1
        return number * min(COMPARE.most_folds, count) // count

    def train(self, windows: Windows) -> Array:
        """Which windows share no time with held-out data, shape (W,)."""
        if self.held_sources:
            return ~self._whole(windows)
        ends = np.stack([self.index(windows), self.index(windows, 1.0)])
        return np.asarray((ends % COMPARE.held_out_every != COMPARE.first_held).all(axis=0))


def make_blocks(recordings: Recordings, hold_out: Recordings, own: bool = False) -> Blocks:
    """Blocks of 2 s, or an eighth of a recording shorter than 16 s; see `Blocks`."""
    everything = [*recordings, *hold_out]
    begin, duration = np.array([_span(r) for r in everything]).T
    length = np.maximum(np.minimum(COMPARE.block_seconds, duration / COMPARE.fewest_blocks), 1e-9)
    count = np.floor(duration / length).astype(int) + 2
    # by what recordings differ, parts of one bag too
    names = [(r.path.name, str(r.path), *_span(r)) for r in everything]
    by_name = sorted(range(len(everything)), key=names.__getitem__)
    offset = np.zeros(len(everything), dtype=int)
    offset[by_name] = np.cumsum(count[by_name]) - count[by_name]
    held = tuple(range(len(recordings), len(everything))) if hold_out else ()
    return Blocks(begin, length, offset, held, own)


def _span(recording: Recording) -> tuple[float, float]:
    """First stamp, and how long it lasts [s]."""
    first = min(e.t[0] for e in recording.episodes)
    return float(first), float(max(e.t[-1] for e in recording.episodes) - first)
