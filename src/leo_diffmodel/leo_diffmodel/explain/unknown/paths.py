# SPDX-License-Identifier: Apache-2.0
"""The path each joint has come: how far along its hysteresis it is, and the windows' long past."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from leo_diffmodel.bags.recording import Episode, Recording
from leo_diffmodel.compare.windows import Windows
from leo_diffmodel.explain.settings import Numerics
from leo_diffmodel.explain.unknown.influence import Influence

Array = np.ndarray


def paths(recordings: Sequence[Recording], left: Influence) -> dict[float, Array]:
    """For each reach the state of Dahl's friction in each stretch, -1 to 1, shape (W, G, J)."""
    time, windows, reaches = left.time, left.problem.windows, left.problem.grids.reaches
    z = np.zeros((len(reaches), *left.q.shape))
    for source, recording in enumerate(recordings):
        for episode in recording.episodes:
            inside = (
                (windows.source == source)
                & (time[:, 0] >= episode.t[0])
                & (time[:, -1] <= episode.t[-1])
            )
            along = dahl(episode, np.array(reaches))
            for r, j in np.ndindex(len(reaches), z.shape[-1]):
                z[r, inside, :, j] = np.interp(time[inside], episode.t, along[:, r, j])
    return dict(zip(reaches, z, strict=True))


def dahl(episode: Episode, reach: Array) -> Array:
    """The state along an episode that begins at rest, for each reach [rad], shape (T, R, J)."""
    moved = np.diff(episode.q, axis=0)[:, None, :]
    decay, way = np.exp(-np.abs(moved) / reach[:, None]), np.sign(moved)
    z = np.zeros((len(episode.q), *decay.shape[1:]))
    for k in range(len(moved)):
        z[k + 1] = way[k] + (z[k] - way[k]) * decay[k]
    return z


def with_past(recordings: Sequence[Recording], windows: Windows, numerics: Numerics) -> Windows:
    """These windows with much history each, which a memory of the path needs.

    Where an episode has fewer, its first sample is repeated for an instant.
    """
    episodes = [(source, e) for source, r in enumerate(recordings) for e in r.episodes]
    parts = []
    for source, start in zip(windows.source, windows.start, strict=True):
        inside = (e for s, e in episodes if s == source and e.t[0] <= start <= e.t[-1])
        parts.append(_past(next(inside), float(start), numerics))
    q, dq, inputs, enabled, gaps = (np.stack(column) for column in zip(*parts, strict=True))
    return replace(windows, history=(q, dq, inputs, enabled, gaps))


def _past(episode: Episode, start: float, numerics: Numerics) -> tuple[Array, ...]:
    """Angles, rates, inputs, motors on and lengths of the samples before an instant."""
    first, count = int(np.argmin(np.abs(episode.t - start))), numerics.past_samples
    pick = np.maximum(np.arange(first - count, first), 0)
    gaps = episode.t[np.minimum(pick + 1, first)] - episode.t[pick]
    gaps = np.maximum(gaps, numerics.instant)
    gaps[: max(0, count - first)] = numerics.instant
    names = ('q', 'dq', 'inputs', 'enabled')
    return (*(getattr(episode, name)[pick] for name in names), gaps)
