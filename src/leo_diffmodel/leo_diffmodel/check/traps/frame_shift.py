# SPDX-License-Identifier: Apache-2.0
"""Does the goal in a row act from that row on, or has it acted already?

A loop that reads the joints and then sends the goal (LeRobot's does) writes rows whose goal acts
afterwards; one that sends, waits and reads, or that writes the observation after the step (as of
gym environments), writes rows whose goal has acted: everything seems to come a frame early.

A goal cannot move a joint before it was sent. So each angle is predicted from the angles and the
goals of the rows before it and the goal of its own row, and it is asked which is the newest goal
that has a share in it (Granger's test of causes). Goals that go on evenly say nothing: the
newest follow from those before, and shares are not sure.
"""

from __future__ import annotations

import numpy as np

from leo_diffmodel.bags.recording import Episode, Recording
from leo_diffmodel.check.finding import Finding, OK, WARNING
from leo_diffmodel.check.timing import steps

Array = np.ndarray
EARLY, OWN, LATE = 0, 1, 2
"""Rows from the goal to the angle that it moves first."""
PAST = 4
"""Rows before it that an angle is predicted from."""
FEWEST = 60
SURE = 5.0
SMALL = 0.3
"""Of the share of a goal: what those of newer ones must surely be below."""
FLOOR = 1e-9
"""rad."""


def frame_shift(recording: Recording) -> list[Finding]:
    """Say of position goals in which frame they act; nothing where no joint moves."""
    if recording.input != 'position':
        return []
    joints = [recording.joints.index(name) for name in recording.actuators]
    moving = [(j, a) for a, j in enumerate(joints) if _moves(_usable(recording, a), j)]
    if not moving:
        return []
    told = {_first(*_shares(recording, j, a)) for j, a in moving} - {None}
    if len(told) != 1:
        return [Finding('frame', OK, 'in which frame a goal acts does not show here')]
    return [_told(told.pop(), 1e3 * float(np.median(steps(recording))))]


def _first(share: Array, spread: Array) -> int | None:
    """Return the newest row whose goal has a share, None where newer ones may have one as well.

    Args:
        share: of the goals in the angle, the newest first, shape (R,).
        spread: their standard deviations, shape (R,).
    """
    for row in (EARLY, OWN, LATE):
        if share[row] > SURE * spread[row] and share[row] > SMALL * share.max():
            newer = np.abs(share[:row]) + 2 * spread[:row]
            return row if (newer < SMALL * share[row]).all() else None
    return None


def _told(row: int | None, period: float) -> Finding:
    if row == EARLY:
        what = f'the goal of a row has acted when its positions are read, {period:.0f} ms early'
        todo = 'read the bag with a topic map that says hold: previous'
        return Finding('frame', WARNING, what, (), todo)
    if row == LATE:
        what = f'a goal acts a frame ({period:.0f} ms) after its row'
        return Finding('frame', OK, what, (), 'nothing: explain tries command_delay')
    what = (
        'positions are read before the goal of their row is sent, which acts up to a frame '
        f'({period:.0f} ms) after its stamp'
    )
    return Finding('frame', OK, what)


def _usable(recording: Recording, a: int) -> list[Episode]:
    """Return the episodes that are long enough and have the motor on throughout."""
    return [e for e in recording.episodes if len(e.t) > PAST + 1 and e.enabled[:, a].all()]


def _moves(episodes: list[Episode], j: int) -> bool:
    """Say whether a joint moves in enough frames."""
    return sum(int((np.abs(np.diff(e.q[:, j])) > FLOOR).sum()) for e in episodes) >= FEWEST


def _shares(recording: Recording, j: int, a: int) -> tuple[Array, Array]:
    """Return the share of each goal in the angle of joint j, and its standard deviation, (R,)."""
    rows = [_rows(e, j, a) for e in _usable(recording, a)]
    columns, angle = (np.concatenate(parts) for parts in zip(*rows, strict=True))
    gain = np.linalg.pinv(columns)
    shares = gain @ angle
    left = float(((angle - columns @ shares) ** 2).mean()) + FLOOR**2
    return shares[: PAST + 1], np.sqrt(left * (gain**2).sum(axis=1))[: PAST + 1]


def _rows(e: Episode, j: int, a: int) -> tuple[Array, Array]:
    """Return the goals, newest first, and angles that each angle is predicted from, and it."""
    q, goal, count = e.q[:, j], e.inputs[:, a], len(e.t) - PAST
    goals = [goal[PAST - k : PAST - k + count] for k in range(PAST + 1)]
    angles = [q[PAST - k : PAST - k + count] for k in range(1, PAST + 1)]
    return np.stack([*goals, *angles, np.ones(count)], axis=1), q[PAST:]
