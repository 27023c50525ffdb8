# SPDX-License-Identifier: Apache-2.0
"""Cut recordings into windows of equal sample count, the unit every score is computed on."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, fields

import numpy as np

from leo_diffmodel.bags.recording import Episode, Recording

Array = np.ndarray


@dataclass(frozen=True)
class Windows:
    """W stretches of K control intervals, each with H samples of history before it.

    Attributes:
        q: measured joint angle [rad], shape (W, K+1, J).
        dq: measured joint rate [rad/s], shape (W, K+1, J).
        inputs: applied input [V, N m or rad], shape (W, K, A); row k acts from sample k to k+1.
        enabled: motors on, shape (W, K, A).
        dt: length of each interval [s], shape (W, K).
        start: time of the first sample [s], shape (W,).
        source: index of the recording each window comes from, shape (W,).
        held: the base was fixed, shape (W,).
        history: the same five arrays for the H samples before, or None where H is 0.
        recordings: names of the recordings, by which `source` counts.
    """

    q: Array
    dq: Array
    inputs: Array
    enabled: Array
    dt: Array
    start: Array
    source: Array
    held: Array
    history: tuple[Array, Array, Array, Array, Array] | None = None
    recordings: tuple[str, ...] = ()

    @property
    def count(self) -> int:
        """Number of windows."""
        return len(self.start)

    @property
    def steps(self) -> int:
        """Number of intervals in each window."""
        return self.dt.shape[1]

    @property
    def measured(self) -> Array:
        """Angle and rate side by side, shape (W, K+1, 2J)."""
        return np.concatenate([self.q, self.dq], axis=-1)

    def take(self, index: Array) -> Windows:
        """The windows at `index` (integers or a mask)."""
        whole = ('history', 'recordings')
        picked = {
            f.name: getattr(self, f.name)[index] for f in fields(self) if f.name not in whole
        }
        past = None if self.history is None else tuple(part[index] for part in self.history)
        return Windows(**picked, history=past, recordings=self.recordings)

    def of(self, recording: str) -> Array:
        """Which windows come from the recording of that name, shape (W,)."""
        names = np.array(self.recordings, dtype=object)
        return np.asarray(names[self.source] == recording)


def sample_period(recordings: Sequence[Recording]) -> float:
    """Median time between joint states over all recordings [s]."""
    steps = [np.diff(e.t) for r in recordings for e in r.episodes if len(e.t) > 1]
    return float(np.median(np.concatenate(steps))) if steps else float('nan')


def cut(
    recordings: Sequence[Recording],
    seconds: float,
    *,
    stride: float | None = None,
    history: float = 0.0,
) -> Windows:
    """Windows of about `seconds`, none across an episode's end.

    Args:
        recordings: what to cut; all of one robot.
        seconds: length of a window; at least one sample interval.
        stride: time from start to start; by default windows share no sample.
        history: time before each window to keep [s]; windows without it are left out.

    Raises:
        ValueError: no episode is long enough.
    """
    period = sample_period(recordings)
    count = max(1, round(seconds / period))
    skip = count + 1 if stride is None else max(1, round(stride / period))
    past = int(np.ceil(history / period)) if history > 0 else 0
    pieces = list(_pieces(recordings, count, skip, past))
    if not pieces:
        raise ValueError(f'no episode holds a window of {seconds:g} s')
    return _stack(pieces, count, past, recordings)


def _pieces(
    recordings: Sequence[Recording], count: int, skip: int, past: int
) -> Iterator[tuple[Episode, int, int]]:
    for source, recording in enumerate(recordings):
        for episode in recording.episodes:
            for first in range(past, len(episode.t) - count, skip):
                yield episode, first, source


def _stack(
    pieces: list[tuple[Episode, int, int]], count: int, past: int, recordings: Sequence[Recording]
) -> Windows:
    def states(name: str) -> Array:
        return np.stack([getattr(e, name)[i : i + count + 1] for e, i, _ in pieces])

    def held(name: str) -> Array:
        return np.stack([getattr(e, name)[i : i + count] for e, i, _ in pieces])

    def before(name: str) -> Array:
        return np.stack([getattr(e, name)[i - past : i] for e, i, _ in pieces])

    times, source = states('t'), np.array([s for _, _, s in pieces])
    history = None
    if past:
        gaps = np.stack([np.diff(e.t[i - past : i + 1]) for e, i, _ in pieces])
        history = (before('q'), before('dq'), before('inputs'), before('enabled'), gaps)
    return Windows(
        q=states('q'),
        dq=states('dq'),
        inputs=held('inputs'),
        enabled=held('enabled'),
        dt=np.diff(times, axis=1),
        start=times[:, 0],
        source=source,
        held=np.array([r.held for r in recordings])[source],
        history=history,
        recordings=tuple(r.name for r in recordings),
    )
