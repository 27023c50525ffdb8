# SPDX-License-Identifier: Apache-2.0
"""Inputs that are another joint's, or that the log has as 0 although they acted."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from itertools import groupby

import numpy as np
from scipy.optimize import linear_sum_assignment

from leo_diffmodel.bags.recording import Recording
from leo_diffmodel.faults.base import Found
from leo_diffmodel.faults.catalogue import FAULTS
from leo_diffmodel.faults.left_out import better, misses, Reading, rest
from leo_diffmodel.faults.settings import LIMITS
from leo_diffmodel.outside.flow import Flow

Array = np.ndarray


def exchanged(recording: Recording, seen: Flow, driven: Sequence[str]) -> Found | None:
    """The inputs that stand in each other's columns; None where all are in their own.

    The motion of each joint that does not explain its own input is held against the others' inputs.
    """
    joints = [recording.joints.index(name) for name in driven]
    odd = [j for j in joints if _unexplained(seen, j, j) > LIMITS.odd]
    if len(odd) < 2:
        return None
    left = np.array([[_unexplained(seen, j, k) for k in odd] for j in odd])
    column = linear_sum_assignment(left)[1]
    moved = [i for i in range(len(odd)) if left[i, column[i]] < LIMITS.own * left[i, i]]
    if not moved or {*moved} != {int(column[i]) for i in moved}:
        return None
    pairs = [(odd[i], odd[column[i]]) for i in moved]
    other = [misses(seen, j, [Reading(column=k)]) for j, k in pairs]
    if better([misses(seen, j) for j, _ in pairs], other) < LIMITS.sure:
        return None
    names = [(recording.joints[j], recording.joints[k]) for j, k in pairs]
    share = float(np.mean([left[i, column[i]] for i in moved]))
    own = float(np.mean([left[i, i] for i in moved]))
    what = (
        f'the inputs of {" and ".join(j for j, _ in names)} stand in each other\'s columns: '
        f'so their motion explains {1 - share:.0%} of them, as logged {max(1 - own, 0.0):.0%}'
    )
    together = tuple(name for pair in names for name in pair)
    value = float(len(names))
    return Found(
        FAULTS['input_exchanged'], '', value, 0.0, what, True, 'balance', names=together
    )


def _unexplained(seen: Flow, j: int, k: int) -> float:
    """Share of the input of joint k that the motion of joint j does not explain."""
    moving = seen.moving[:, j] > LIMITS.moving
    whole = float(np.abs(seen.motor[moving, k]).sum())
    if moving.sum() < LIMITS.fewest_instants or whole < 1e-12:
        return 0.0 if j == k else 1.0
    return float(np.abs(rest(seen, j, moving, Reading(column=k))[moving]).sum()) / whole


def dead_input(recording: Recording, seen: Flow, joint: str) -> Iterator[Found]:
    """Whether a joint goes on as if it were driven while the log has exactly 0 for its input."""
    j = recording.joints.index(joint)
    moving, idle = seen.moving[:, j] > LIMITS.moving, seen.motor[:, j] == 0
    on, off = moving & ~idle, moving & idle
    if min(on.sum(), off.sum()) < LIMITS.fewest_instants:
        return
    usual = _median(rest(seen, j, on)[on])
    besides = _median(rest(seen, j, moving)[off])
    if besides > max(LIMITS.dead * usual, LIMITS.drives * _median(seen.motor[on, j])):
        a = recording.actuators.index(joint)
        zero = [e.inputs[:, a] == 0 for e in recording.episodes]
        share = float(np.concatenate(zero).mean())
        spans = [
            (float(e.t[rows[0]]), float(e.t[rows[-1]]))
            for e, none in zip(recording.episodes, zero, strict=True)
            for rows in _runs(none)
        ]
        what = (
            f'the input of {joint} is logged as 0 in {share:.0%} of the rows, and what moves it '
            f'then is as large as a motor\'s'
        )
        where = tuple(s for s in spans if s[1] - s[0] > seen.bell)
        yield Found(FAULTS['input_dead'], joint, share, 0.0, what, True, 'balance', where=where)


def _median(values: Array) -> float:
    return float(np.median(np.abs(values)))


def _runs(inside: Array) -> list[list[int]]:
    """Rows of each run of rows that are all inside."""
    return [[*rows] for is_in, rows in groupby(range(len(inside)), lambda i: inside[i]) if is_in]
