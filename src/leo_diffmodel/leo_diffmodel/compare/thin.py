# SPDX-License-Identifier: Apache-2.0
"""Bring recordings of different and of high rates to one rate that still shows every effect.

A search costs in proportion to the samples, and windows are cut by sample count: a log at
500 Hz beside one at 200 Hz would cost most of the time and stretch the windows of the other.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from leo_diffmodel.bags.recording import Episode, Recording
from leo_diffmodel.compare.windows import sample_period

Array = np.ndarray
SHORTEST = 0.005
LONGEST = 0.01
"""Of the common period [s]."""
FEWEST = 10
"""Samples of an episode that has a say in it: after cuts, a few may be left with a gap amid."""


def thin(recordings: Sequence[Recording]) -> list[Recording]:
    """The recordings with every n-th state, as near as that comes to the period of the slowest.

    Each episode has its own n: one bag may hold logs of several rates. The common period is held
    between 5 ms and 10 ms: rates up to 200 Hz stay as they are, beside slower ones up to 100 Hz.
    States are left out and not averaged, so their noise stays white; inputs become the mean over
    the longer steps.
    """
    slowest = max(periods(recordings), default=SHORTEST)
    return [_thinned(r, min(max(slowest, SHORTEST), LONGEST)) for r in recordings]


def periods(recordings: Sequence[Recording]) -> list[float]:
    """Median time between states of each episode that is long enough to have one [s]."""
    return [_period(e) for r in recordings for e in r.episodes if len(e.t) >= FEWEST]


def every(recording: Recording, stride: int) -> Recording:
    """The recording with every n-th state, and the mean inputs between them."""
    return _kept(recording, [stride] * len(recording.episodes))


def _thinned(recording: Recording, target: float) -> Recording:
    return _kept(recording, [max(1, round(target / _period(e))) for e in recording.episodes])


def _kept(recording: Recording, strides: Sequence[int]) -> Recording:
    if max(strides) == 1:
        return recording
    both = zip(recording.episodes, strides, strict=True)
    episodes = tuple(_shorter(e, n) for e, n in both if len(e.t) > n)
    if not episodes:
        return recording
    period = max(recording.command_period, sample_period([replace(recording, episodes=episodes)]))
    return replace(recording, episodes=episodes, command_period=period)


def _period(episode: Episode) -> float:
    """Median time between its states [s]."""
    return float(np.median(np.diff(episode.t)))


def _shorter(episode: Episode, stride: int) -> Episode:
    kept = np.arange(0, len(episode.t), stride)
    return Episode(
        t=episode.t[kept],
        q=episode.q[kept],
        dq=episode.dq[kept],
        inputs=_mean(episode, episode.inputs, kept),
        enabled=_mean(episode, episode.enabled.astype(float), kept) > 0.5,
        effort=None if episode.effort is None else episode.effort[kept],
    )


def _mean(episode: Episode, held: Array, kept: Array) -> Array:
    """Means over the longer steps of what is held over the short ones; the last row as it is."""
    area = np.cumsum(held[:-1] * np.diff(episode.t)[:, None], axis=0)
    until = np.vstack([np.zeros((1, held.shape[1])), area])[kept]
    width = np.diff(episode.t[kept])[:, None]
    return np.vstack([np.diff(until, axis=0) / width, held[kept[-1:]]])
