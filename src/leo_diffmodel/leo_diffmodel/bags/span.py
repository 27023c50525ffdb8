# SPDX-License-Identifier: Apache-2.0
"""Parts of a recording, by time; bags that are the same."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from leo_msgs_py.errors import UserError

from .recording import Episode, Recording


def distinct(recordings: Iterable[Recording]) -> None:
    """See that no bag is there twice.

    Raises:
        UserError: one is.
    """
    seen: dict[str, Recording] = {}
    for recording in recordings:
        if first := seen.get(recording.sha256):
            raise UserError(
                f'{recording.path} is the same bag as {first.path}; give each once, '
                'and hold out bags that nothing is learned from'
            )
        seen[recording.sha256] = recording


def between(
    recording: Recording, begin: float | None = None, end: float | None = None
) -> Recording:
    """The part of a recording from `begin` to `end`, both included.

    Args:
        recording: what to cut; its times stay as they are.
        begin: since the recording's first state [s]; None from there on.
        end: the same [s]; None for all that follows.

    Raises:
        UserError: the end is not after the begin, or fewer than two samples lie between.
    """
    low, high = check(begin, end)
    found = [(e.t >= low - 1e-9) & (e.t <= high + 1e-9) for e in recording.episodes]
    parts = [
        part(e, np.flatnonzero(m))
        for e, m in zip(recording.episodes, found, strict=True)
        if m.sum() >= 2
    ]
    if not parts:
        last = max(float(e.t[-1]) for e in recording.episodes)
        raise UserError(
            f'{recording.path} has no states from {low:g} to {high:g} s; it lasts {last:.2f} s'
        )
    return replace(recording, episodes=tuple(parts))


def check(begin: float | None, end: float | None) -> tuple[float, float]:
    """The two as numbers [s], 0 and infinity where open.

    Raises:
        UserError: they enclose nothing.
    """
    low, high = 0.0 if begin is None else begin, np.inf if end is None else end
    if not (low >= 0 and high > low):
        raise UserError(f'from {low:g} to {high:g} s is no time; give --from before --to, from 0')
    return low, high


def kept(
    recording: Recording, out: Sequence[tuple[float, float]], least: float
) -> Recording | None:
    """A recording less some stretches of time.

    Args:
        recording: what to cut.
        out: begin and end of each stretch [s], in order and apart.
        least: shorter pieces are dropped [s].

    Returns:
        None where nothing remains.
    """
    pieces = [p for e in recording.episodes for p in _pieces(e, out, least)]
    return replace(recording, episodes=tuple(pieces)) if pieces else None


def _pieces(e: Episode, out: Sequence[tuple[float, float]], least: float) -> list[Episode]:
    number = np.zeros(len(e.t), dtype=int)
    stays = np.ones(len(e.t), dtype=bool)
    for begin, end in out:
        number += e.t > end
        stays &= (e.t < begin) | (e.t > end)
    groups = [np.flatnonzero(stays & (number == n)) for n in range(len(out) + 1)]
    return [part(e, g) for g in groups if len(g) > 1 and e.t[g[-1]] - e.t[g[0]] >= least]


def merged(
    stretches: Iterable[tuple[float, float]], within: float
) -> tuple[tuple[float, float], ...]:
    """Stretches of time in order, those less than `within` [s] apart as one."""
    out: list[tuple[float, float]] = []
    for begin, end in sorted(stretches):
        if out and begin - out[-1][1] < within:
            out[-1] = (out[-1][0], max(end, out[-1][1]))
        else:
            out.append((begin, end))
    return tuple(out)


def part(e: Episode, index: NDArray[np.int_]) -> Episode:
    """The samples of an episode at neighbouring indices."""
    return Episode(
        t=e.t[index],
        q=e.q[index],
        dq=e.dq[index],
        inputs=e.inputs[index],
        enabled=e.enabled[index],
        effort=None if e.effort is None else e.effort[index],
    )
