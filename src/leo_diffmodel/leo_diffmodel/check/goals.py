# SPDX-License-Identifier: Apache-2.0
"""Position goals as logged: were they what was sent, and in which row do they act?"""

from collections.abc import Iterator

import numpy as np
from numpy.lib.stride_tricks import sliding_window_view

from leo_diffmodel.bags.episode import merged
from leo_diffmodel.bags.importing.guess_roles import role_of
from leo_diffmodel.bags.recording import Episode, Recording
from leo_diffmodel.check.settings import CHECK
from leo_diffmodel.compare.windows import Array
from leo_diffmodel.outside.finding import Finding, OK, times, WARNING
from leo_diffmodel.outside.samples import runs

EARLY, OWN, LATE = 0, 1, 2  # rows from the goal to the angle that it moves first
TODO = 'log what was sent (what send_action returns), or cut these parts out: leo bag cut'


def asked(recording: Recording) -> list[Finding]:
    """Whether inputs are requests, by the name of their column, and where they were not met.

    LeRobot's record loop saves the action it asks for and drops what `send_action` returns, which
    is the action after clipping. It shows where a joint stands at an end of what it ever reached
    while its goal, farther out, goes on.
    """
    actuators = recording.actuators if recording.input == 'position' else ()
    out = [f for a, joint in enumerate(actuators) for f in _unmet(recording, a, joint)]
    columns = recording.metadata.get('inputs_from', '').split(', ')
    named = [column for column in columns if role_of(column).is_goal]
    if named and not out:
        more = f' and {len(named) - 1} more' if len(named) > 1 else ''
        what = f'inputs are what was asked for ({named[0]}{more}), not what was sent; nothing '
        what += 'shows here that the two differ'
        out.append(Finding('asked', OK, what, TODO))
    return out


def _unmet(recording: Recording, a: int, joint: str) -> Iterator[Finding]:
    """The stretches in which a joint stands at its end and its goal goes on beyond."""
    j = recording.joints.index(joint)
    q = np.concatenate([e.q[:, j] for e in recording.episodes])
    low, high = float(q.min()), float(q.max())
    parts = (s for e in recording.episodes for s in _spans(e, j, a, low, high))
    found = merged(parts, CHECK.unmet_apart)
    if found:
        what = f'{joint} stands at the end of its range while its goal goes on beyond, '
        what += f'{times(found)}: the goal was clipped on the way, or the joint blocked'
        yield Finding('asked', WARNING, what, TODO, found)


def _spans(e: Episode, j: int, a: int, low: float, high: float) -> Iterator[tuple[float, float]]:
    q, goal, span = e.q[:, j], e.inputs[:, a], high - low
    above = (q > high - CHECK.at_end * span) & (goal > high + CHECK.beyond * span)
    below = (q < low + CHECK.at_end * span) & (goal < low - CHECK.beyond * span)
    for there in (above & e.enabled[:, a], below & e.enabled[:, a]):
        for rows in runs(there):
            begin, end, moved = float(e.t[rows[0]]), float(e.t[rows[-1]]), np.ptp(goal[rows])
            stands = np.ptp(q[rows]) <= CHECK.follows * moved
            long = end - begin >= CHECK.unmet_seconds
            if long and stands and moved > CHECK.goal_moves * span:
                yield begin, end


def frame_shift(recording: Recording) -> list[Finding]:
    """In which frame position goals act; nothing where no joint moves.

    A loop that reads the joints and then sends the goal (LeRobot's does) writes rows whose goal
    acts afterwards; one that sends, waits and reads, or that writes the observation after the step
    (as of gym environments), writes rows whose goal has acted: everything seems a frame early.

    A goal cannot move a joint before it was sent. So each angle is predicted from the angles and
    the goals of the rows before it and the goal of its own row, and the newest goal that has a
    share in it is looked for (Granger's test of causes). Goals that go on evenly say nothing: the
    newest follow from those before, and shares are not sure.
    """
    if recording.input != 'position':
        return []
    joints = [recording.joints.index(name) for name in recording.actuators]
    moving = [(j, a) for a, j in enumerate(joints) if _moves(_usable(recording, a), j)]
    if not moving:
        return []
    rows = {_first(*_shares(recording, j, a)) for j, a in moving} - {None}
    if len(rows) != 1:
        return [Finding('frame', OK, 'in which frame a goal acts does not show here')]
    return [_acts_in(rows.pop(), f'{1e3 * recording.state_period:.0f} ms')]


def _first(share: Array, spread: Array) -> int | None:
    """The newest row whose goal has a share; None where newer ones may have one as well.

    Shares of the goals in the angle, the newest first, and their standard deviations are (R,).
    """
    small = CHECK.small_share
    for row in (EARLY, OWN, LATE):
        if share[row] > CHECK.frame_sigmas * spread[row] and share[row] > small * share.max():
            newer = np.abs(share[:row]) + 2 * spread[:row]
            return row if (newer < small * share[row]).all() else None
    return None


def _acts_in(row: int | None, frame: str) -> Finding:
    if row == EARLY:
        what = f'the goal of a row has acted when its positions are read, {frame} early'
        todo = 'read the bag with a topic map that says hold: previous'
        return Finding('frame', WARNING, what, todo)
    if row == LATE:
        what = f'a goal acts a frame ({frame}) after its row'
        return Finding('frame', OK, what, 'nothing: explain tries command_delay')
    read = 'positions are read before the goal of their row is sent, which acts up to a frame'
    return Finding('frame', OK, f'{read} ({frame}) after its stamp')


def _usable(recording: Recording, a: int) -> list[Episode]:
    return [e for e in recording.episodes if len(e.t) > CHECK.past + 1 and e.enabled[:, a].all()]


def _moves(episodes: list[Episode], j: int) -> bool:
    moved = [np.abs(np.diff(e.q[:, j])) > CHECK.frame_floor for e in episodes]
    return sum(int(frames.sum()) for frames in moved) >= CHECK.frames


def _shares(recording: Recording, j: int, a: int) -> tuple[Array, Array]:
    """The share of each goal in the angle of joint j, and its standard deviation, (R,)."""
    rows = [_rows(e, j, a) for e in _usable(recording, a)]
    columns, angle = (np.concatenate(parts) for parts in zip(*rows, strict=True))
    gain = np.linalg.pinv(columns)
    shares, goals = gain @ angle, CHECK.past + 1
    left = float(((angle - columns @ shares) ** 2).mean()) + CHECK.frame_floor**2
    return shares[:goals], np.sqrt(left * (gain**2).sum(axis=1))[:goals]


def _rows(e: Episode, j: int, a: int) -> tuple[Array, Array]:
    """The goals and angles, newest first, that each angle is predicted from, and it."""
    both = e.inputs[:, a], e.q[:, j]
    goals, angles = (sliding_window_view(x, CHECK.past + 1)[:, ::-1] for x in both)
    return np.concatenate([goals, angles[:, 1:], np.ones((len(goals), 1))], axis=1), angles[:, 0]
