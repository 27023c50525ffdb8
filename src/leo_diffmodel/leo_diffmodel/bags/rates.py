# SPDX-License-Identifier: Apache-2.0
"""Logs of several rates in one bag: they are as many recordings as if each had its own bag.

A recording has one rate, one noise and one command period; what was logged at another rate was
logged by something else, which has its own.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import replace

import numpy as np

from .episode import Episode, Recording

NEAR = 1.05
"""Times: periods of one log are no further apart."""
LEAST = 2.0
"""s in one episode, for a rate of its own to count: less is no recording."""


def by_rate(recordings: Iterable[Recording]) -> list[Recording]:
    """The recordings; one whose episodes come at several rates as one recording for each."""
    return [part for recording in recordings for part in _parts(recording)]


def _parts(recording: Recording) -> list[Recording]:
    first: list[Episode] = []
    for e in recording.episodes:
        if e.t[-1] - e.t[0] >= LEAST and not any(_alike(e, other) for other in first):
            first.append(e)
    if len(first) < 2:
        return [recording]
    rates = [next((k for k, f in enumerate(first) if _alike(e, f)), 0) for e in recording.episodes]
    both = list(zip(rates, recording.episodes, strict=True))
    return [_part(recording, k, [e for n, e in both if n == k]) for k in range(len(first))]


def _alike(a: Episode, b: Episode) -> bool:
    """Whether the usual step of one is among the middle half of the other's, or near it."""
    low, usual, high = np.quantile(np.diff(a.t), (0.25, 0.5, 0.75))
    other_low, other, other_high = np.quantile(np.diff(b.t), (0.25, 0.5, 0.75))
    return bool(
        low / NEAR <= other <= high * NEAR or other_low / NEAR <= usual <= other_high * NEAR
    )


def _part(recording: Recording, number: int, episodes: list[Episode]) -> Recording:
    """The episodes of one rate; a command with each state is one with each state of theirs.

    Gaps in the bag are none of a part's.
    """
    period, whole = _period(episodes), _period(recording.episodes)
    path = recording.path.with_name(f'{recording.name} (part {number + 1}, {1 / period:.4g} Hz)')
    of_all = recording.command_period
    told = [w for w in recording.warnings if not w.endswith('gaps; split there')]
    return replace(
        recording,
        path=path,
        command_period=period if whole / NEAR < of_all < whole * NEAR else of_all,
        episodes=tuple(episodes),
        warnings=tuple(w.replace(str(recording.path), str(path), 1) for w in told if not number),
    )


def _period(episodes: Iterable[Episode]) -> float:
    return float(np.median(np.concatenate([np.diff(e.t) for e in episodes])))
