# SPDX-License-Identifier: Apache-2.0
"""Inputs that were asked for and not what was sent: clipped or held back on the way.

LeRobot's record loop saves the action it asks for and drops what `send_action` returns, which is
the action after clipping. It shows where a joint stands at an end of what it ever reached while
its goal, farther out, goes on.
"""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from leo_diffmodel.bags.episode import merged
from leo_diffmodel.bags.importing.guess_roles import role_of
from leo_diffmodel.bags.recording import Episode, Recording
from leo_diffmodel.check.finding import Finding, OK, times, WARNING

Array = np.ndarray
AT_END = 0.03
BEYOND = 0.1
MOVES = 0.05
"""Of the joint's range: how near its end it stands, how far out and how much the goal moves."""
FOLLOWS = 0.1
"""Of what its goal moves: what a joint that stands may move."""
LEAST_SECONDS = 0.2
TODO = 'log what was sent (what send_action returns), or cut these parts out: leo bag cut'


def asked(recording: Recording) -> list[Finding]:
    """Say that inputs are requests, by the name of their column, and where they were not met."""
    out = [
        finding
        for a, joint in enumerate(recording.actuators)
        if recording.input == 'position'
        for finding in _unmet(recording, a, joint)
    ]
    columns = recording.metadata.get('inputs_from', '').split(', ')
    named = [column for column in columns if role_of(column).is_goal]
    if named and not out:
        more = f' and {len(named) - 1} more' if len(named) > 1 else ''
        what = (
            f'inputs are what was asked for ({named[0]}{more}), not what was sent; nothing '
            'shows here that the two differ'
        )
        out.append(Finding('asked', OK, what, (), TODO))
    return out


def _unmet(recording: Recording, a: int, joint: str) -> Iterator[Finding]:
    """Yield the stretches in which a joint stands at its end and its goal goes on beyond."""
    j = recording.joints.index(joint)
    q = np.concatenate([e.q[:, j] for e in recording.episodes])
    low, high = float(q.min()), float(q.max())
    found = merged((s for e in recording.episodes for s in _stretches(e, j, a, low, high)), 0.1)
    if found:
        what = (
            f'{joint} stands at the end of its range while its goal goes on beyond, '
            f'{times(found)}: the goal was clipped on the way, or the joint blocked'
        )
        yield Finding('asked', WARNING, what, found, TODO)


def _stretches(
    e: Episode, j: int, a: int, low: float, high: float
) -> Iterator[tuple[float, float]]:
    q, goal, span = e.q[:, j], e.inputs[:, a], high - low
    above = (q > high - AT_END * span) & (goal > high + BEYOND * span)
    below = (q < low + AT_END * span) & (goal < low - BEYOND * span)
    for there in (above & e.enabled[:, a], below & e.enabled[:, a]):
        edges = np.flatnonzero(np.diff(np.r_[False, there, False]))
        for begin, end in edges.reshape(-1, 2):
            moved = float(np.ptp(goal[begin:end]))
            stands = np.ptp(q[begin:end]) <= FOLLOWS * moved
            long = e.t[end - 1] - e.t[begin] >= LEAST_SECONDS
            if long and stands and moved > MOVES * span:
                yield float(e.t[begin]), float(e.t[end - 1])
