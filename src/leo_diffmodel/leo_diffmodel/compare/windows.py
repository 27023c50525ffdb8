# SPDX-License-Identifier: Apache-2.0
"""Windows of equal sample count, the unit of every score, cut from recordings at one rate."""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from leo_diffmodel.bags.episode import sample_period
from leo_diffmodel.bags.held import mean_held
from leo_diffmodel.bags.recording import Episode, Recording, Recordings
from leo_diffmodel.bags.types import at_rows
from leo_diffmodel.compare.settings import COMPARE

Array = np.ndarray
Piece = tuple[Episode, int, int]  # where a window begins, and the number of its recording


@dataclass(frozen=True)
class Windows:
    """W stretches of K control intervals, each with H samples of history before it."""

    q: Array  # measured joint angle [rad], shape (W, K+1, J)
    dq: Array  # measured joint rate [rad/s], shape (W, K+1, J)
    inputs: Array
    """Applied input [V, N m or rad], shape (W, K, A); row k acts from sample k to k+1."""
    enabled: Array  # motors on, shape (W, K, A)
    dt: Array  # length of each interval [s], shape (W, K)
    start: Array  # time of the first sample [s], shape (W,)
    source: Array  # index of the recording each window comes from, shape (W,)
    held: Array  # the base was fixed, shape (W,)
    history: tuple[Array, Array, Array, Array, Array] | None = None
    """The same five arrays for the H samples before, or None where H is 0."""
    recordings: tuple[str, ...] = ()  # names of the recordings, by which `source` counts

    @property
    def count(self) -> int:
        return len(self.start)

    @property
    def steps(self) -> int:
        return self.dt.shape[1]

    @property
    def spans(self) -> Array:
        """Begin and end of each window [s], shape (W, 2)."""
        return np.stack([self.start, self.start + self.dt.sum(axis=1)], axis=1)

    @property
    def measured(self) -> Array:
        """Angles, then rates, shape (W, K+1, 2J)."""
        return np.concatenate([self.q, self.dq], axis=-1)

    def take(self, index: Array) -> 'Windows':
        """The windows at `index` (integers or a mask)."""
        past = None if self.history is None else tuple(part[index] for part in self.history)
        return replace(at_rows(self, index), history=past)

    def of(self, recording: str) -> Array:
        """Which windows come from the recording of that name, shape (W,)."""
        names = np.array(self.recordings, dtype=object)
        return np.asarray(names[self.source] == recording)


def cut(
    recordings: Recordings, seconds: float, *, stride: float | None = None, history: float = 0.0
) -> Windows:
    """Windows of about `seconds`, none across an episode's end, `stride` [s] from start to start.

    By default they share no sample. They keep `history` [s] before them, and are left out where
    there is less; of servos that are sent goals more is kept where there is. ValueError without
    any.
    """
    period = sample_period(recordings)
    count = max(1, round(seconds / period))
    skip = count + 1 if stride is None else max(1, round(stride / period))
    past = int(np.ceil(history / period)) if history > 0 else 0
    pieces = [
        (episode, first, source)
        for source, recording in enumerate(recordings)
        for episode in recording.episodes
        for first in range(past, len(episode.t) - count, skip)
    ]
    if not pieces:
        bags = ', '.join(dict.fromkeys(r.name for r in recordings))
        raise ValueError(f'no episode of {bags} holds a window of {seconds:g} s')
    goals = past and any(r.input == 'position' for r in recordings)
    kept = max(past, int(np.ceil(COMPARE.history_of_goals / period))) if goals else past
    return _stack(pieces, count, kept, recordings)


def _stack(pieces: list[Piece], count: int, past: int, recordings: Recordings) -> Windows:
    def rows(name: str, first: int, last: int) -> Array:
        return np.stack([getattr(e, name)[i + first : i + last] for e, i, _ in pieces])

    source = np.array([s for _, _, s in pieces])
    times = rows('t', 0, count + 1)
    return Windows(
        q=rows('q', 0, count + 1),
        dq=rows('dq', 0, count + 1),
        inputs=rows('inputs', 0, count),
        enabled=rows('enabled', 0, count),
        dt=np.diff(times, axis=1),
        start=times[:, 0],
        source=source,
        held=np.array([r.held for r in recordings])[source],
        history=_before(pieces, past) if past else None,
        recordings=tuple(r.name for r in recordings),
    )


def with_past(recordings: Recordings, windows: Windows, samples: int) -> Windows:
    """These windows with so much history, which a memory of the path needs."""
    pieces = []
    for source, start in zip(windows.source, windows.start, strict=True):
        episode = next(e for e in recordings[source].episodes if e.t[0] <= start <= e.t[-1])
        pieces.append((episode, int(np.argmin(np.abs(episode.t - start))), source))
    return replace(windows, history=_before(pieces, samples))


def _before(pieces: list[Piece], samples: int) -> tuple[Array, Array, Array, Array, Array]:
    """So much history of each; where there is less, the first sample again, for an instant."""
    picks = [(e, np.maximum(np.arange(first - samples, first + 1), 0)) for e, first, _ in pieces]
    names = 'q', 'dq', 'inputs', 'enabled'
    q, dq, u, on = (np.stack([getattr(e, name)[at[:-1]] for e, at in picks]) for name in names)
    gaps = np.diff([e.t[at] for e, at in picks], axis=1)
    return q, dq, u, on, np.maximum(gaps, COMPARE.instant)


def spread_out(windows: Windows, most: int) -> Windows:
    if windows.count <= most:
        return windows
    return windows.take(evenly(windows.count, most))


def evenly(count: int, most: int) -> Array:
    """Numbers of at most `most` of so many things, evenly chosen, shape (min(count, most),)."""
    return np.linspace(0, count - 1, min(count, most)).astype(int)


def per_window(sigma: Array, windows: Windows) -> Array:
    """Noise (R, 2J) or (R, K+1, 2J) of the recording of each window, (W, 1 or K+1, 2J)."""
    return sigma.reshape(len(sigma), -1, sigma.shape[-1])[windows.source]


def thin(recordings: Recordings) -> list[Recording]:
    """The recordings with every n-th state, as near as that comes to the period of the slowest.

    The common period is 5 ms to 10 ms, since a search costs in proportion to the samples. States
    are left out and not averaged, so their noise stays white; inputs become means.
    """
    shortest, longest = COMPARE.shortest_period, COMPARE.longest_period
    period = min(max([shortest, *_periods(recordings)]), longest)
    return [every(r, [max(1, round(period / e.period)) for e in r.episodes]) for r in recordings]


def at_one_rate(recordings: Recordings) -> Recordings:
    """As they are, or thinned where one is sampled half as often again as another."""
    steps = _periods(recordings) or [0.0]
    return thin(recordings) if max(steps) > COMPARE.rates_apart * min(steps) else recordings


def _periods(recordings: Recordings) -> list[float]:
    """Median time between states of each episode that is long enough to have one [s]."""
    episodes = (e for r in recordings for e in r.episodes)
    return [e.period for e in episodes if len(e.t) >= COMPARE.fewest_samples]


def every(recording: Recording, strides: Sequence[int]) -> Recording:
    """The recording with every n-th state of each episode, and the mean inputs between them."""
    if max(strides) == 1:
        return recording
    both = zip(recording.episodes, strides, strict=True)
    episodes = tuple(_shorter(e, n) for e, n in both if len(e.t) > n)
    if not episodes:
        return recording
    period = max(recording.command_period, replace(recording, episodes=episodes).state_period)
    return replace(recording, episodes=episodes, command_period=period)


def _shorter(episode: Episode, stride: int) -> Episode:
    kept = np.arange(0, len(episode.t), stride)
    return replace(
        at_rows(episode, kept),
        inputs=_means(episode, episode.inputs, kept),
        enabled=_means(episode, episode.enabled.astype(float), kept) > 0.5,
    )


def _means(episode: Episode, held: Array, kept: Array) -> Array:
    """Means over the longer steps of what is held over the short ones; the last row as it is."""
    return np.vstack([mean_held(episode.t, held, episode.t[kept]), held[kept[-1:]]])
