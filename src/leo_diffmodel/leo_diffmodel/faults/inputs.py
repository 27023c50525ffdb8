# SPDX-License-Identifier: Apache-2.0
"""Inputs that are another joint's, or that the log has as 0 although they acted."""

from collections.abc import Iterator, Sequence

import numpy as np

from leo_diffmodel.bags.recording import Recording
from leo_diffmodel.faults.found import Found
from leo_diffmodel.faults.left_out import better, mean, misses, Reading, rest
from leo_diffmodel.faults.settings import LIMITS
from leo_diffmodel.outside.finding import ERROR
from leo_diffmodel.outside.flow import Flow
from leo_diffmodel.outside.samples import Array, runs


def exchanged(recording: Recording, seen: Flow, driven: Sequence[str]) -> Found | None:
    """Two inputs that stand in each other's columns; None where each is in its own.

    Of a joint whose motion does not explain its input, the one with which both are predicted best.
    """
    enough = (seen.moving > LIMITS.moving).sum(axis=0) >= LIMITS.fewest_instants
    joints = [j for j in map(recording.joints.index, driven) if enough[j]]
    own = {j: _unexplained(seen, j, j) for j in joints}
    most = {j: LIMITS.own * left for j, left in own.items() if left > LIMITS.odd}
    pairs = [(j, k) for j in most for k in joints if k != j and _unexplained(seen, j, k) < most[j]]
    best = min(pairs, key=lambda p: mean(_swapped(seen, *p)), default=None)
    if best is None:
        return None
    as_logged = np.array([_own(seen, j) / _size(seen, j, j) for j in best])
    swapped = _swapped(seen, *best)
    if better(as_logged, swapped) < LIMITS.sure:
        return None
    a, b = (recording.joints[j] for j in best)
    what = (
        f"the inputs of {a} and {b} stand in each other's columns: exchanged, the motion leaves "
        f'{mean(swapped):.1%} of them unexplained, as logged {mean(as_logged):.1%}'
    )
    return Found('input_exchanged', ERROR, what, value=1.0, evidence='balance', names=(a, b, b, a))


def _own(seen: Flow, j: int) -> Array:
    """What a joint misses of its own input at least, with either sign, (B,)."""
    return min((misses(seen, j, Reading(sign)) for sign in (1.0, -1.0)), key=mean)


def _swapped(seen: Flow, j: int, k: int) -> Array:
    """What both joints miss of each other's input, as a share of it, (2, B)."""
    pairs = (j, k), (k, j)
    return np.array([misses(seen, a, Reading(column=b)) / _size(seen, a, b) for a, b in pairs])


def _size(seen: Flow, j: int, k: int) -> float:
    return max(float(np.abs(seen.motor[seen.moving[:, j] > LIMITS.moving, k]).mean()), 1e-12)


def _unexplained(seen: Flow, j: int, k: int) -> float:
    """Share of the input of joint k that the motion of joint j does not explain.

    An own one may have the other sign.
    """
    moving = seen.moving[:, j] > LIMITS.moving
    if not seen.motor[moving, k].any():
        return 0.0
    signs = (1.0, -1.0) if j == k else (1.0,)
    left = [rest(seen, j, moving, Reading(sign, k))[moving] for sign in signs]
    return min(float(np.abs(x).mean()) for x in left) / _size(seen, j, k)


def dead_input(recording: Recording, seen: Flow, joint: str) -> Iterator[Found]:
    """Whether a joint goes on as if it were driven while the log has exactly 0 for its input."""
    j = recording.joints.index(joint)
    moving, idle = seen.moving[:, j] > LIMITS.moving, seen.motor[:, j] == 0
    on, off = moving & ~idle, moving & idle
    if min(on.sum(), off.sum()) < LIMITS.fewest_instants:
        return
    by_driven, by_all = rest(seen, j, on), rest(seen, j, moving)
    usual, motor = _median(by_driven[on]), _median(seen.motor[on, j])
    besides = _median(by_driven[off]) > max(LIMITS.dead * usual, LIMITS.drives * motor)
    compromise = max(_median(by_all[on]), _median(by_all[off]))
    if besides and compromise > LIMITS.dead_at_least * usual:
        a = recording.actuators.index(joint)
        zero = [e.inputs[:, a] == 0 for e in recording.episodes]
        share = float(np.concatenate(zero).mean())
        both = zip(recording.episodes, zero, strict=True)
        spans = [(float(e.t[r[0]]), float(e.t[r[-1]])) for e, none in both for r in runs(none)]
        what = (
            f'the input of {joint} is logged as 0 in {share:.0%} of the rows, and what moves it '
            f"then is as large as a motor's"
        )
        where = tuple(s for s in spans if s[1] - s[0] > seen.bell)
        yield Found(
            'input_dead', ERROR, what, where=where, joint=joint, value=share, evidence='balance'
        )


def _median(values: Array) -> float:
    return float(np.median(np.abs(values)))
