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


def thin(recordings: Sequence[Recording]) -> list[Recording]:
    """The recordings with every n-th state, as near as that comes to the period of the slowest.

    The common period is held between 5 ms and 10 ms: rates up to 200 Hz stay as they are, beside
    slower ones up to 100 Hz. States are left out and not averaged, so their noise stays white;
    inputs become the mean over the longer steps.
    """
    periods = [sample_period([r]) for r in recordings]
    target = min(max(max(periods, default=SHORTEST), SHORTEST), LONGEST)
    strides = [max(1, round(target / p)) for p in periods]
    return [_every(r, n) if n > 1 else r for r, n in zip(recordings, strides, strict=True)]


def _every(recording: Recording, stride: int) -> Recording:
    episodes = tuple(_shorter(e, stride) for e in recording.episodes if len(e.t) > stride)
    if not episodes:
        return recording
    period = max(recording.command_period, sample_period([replace(recording, episodes=episodes)]))
    return replace(recording, episodes=episodes, command_period=period)


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
