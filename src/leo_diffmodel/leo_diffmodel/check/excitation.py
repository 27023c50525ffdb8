# SPDX-License-Identifier: Apache-2.0
"""What each joint was put through: its ranges, its inputs, and how long it moved or was free."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import asdict, dataclass

import numpy as np

from leo_diffmodel.bags.recording import Recording
from leo_diffmodel.check.finding import Finding, OK, WARNING
from leo_sim.description.constants import INPUT_UNITS

Array = np.ndarray
MOVING_SIGMAS = 5.0
LEAST_MOVING = 0.2
LEAST_OF_BASE = 0.03
ONE_WAY = 0.02
FEWEST_LEVELS = 3


@dataclass(frozen=True)
class Excitation:
    """Ranges of one joint over all bags.

    Attributes:
        joint: its name.
        angle: lowest and highest [rad].
        rate: lowest and highest [rad/s].
        input: lowest and highest applied; None without a motor.
        unit: of the input, V, N m or rad.
        levels: number of different inputs, 0 without a motor.
        moving: share of the time in which the rate stands out of its noise.
        forward: share of the moving time in which the angle grows.
        free: time with its motor off [s].
    """

    joint: str
    angle: tuple[float, float]
    rate: tuple[float, float]
    input: tuple[float, float] | None
    unit: str
    levels: int
    moving: float
    forward: float
    free: float

    def to_json(self) -> dict:
        """Plain lists and numbers."""
        return asdict(self)


def excitation(
    recordings: Sequence[Recording], sigma: Array, base: Sequence[str] = ()
) -> list[Excitation]:
    """One row per joint; those of a base that was held in all bags have none.

    Args:
        recordings: of one robot.
        sigma: noise of each recording and channel, shape (R, 2J).
        base: the joints of its base.
    """
    loose = [i for i, r in enumerate(recordings) if not r.held]
    rows = []
    for j, name in enumerate(recordings[0].joints):
        used = loose if name in base else range(len(recordings))
        if used:
            rows.append(_joint([recordings[i] for i in used], sigma[list(used)], j))
    return rows


def judge(rows: Sequence[Excitation], base: Sequence[str] = ()) -> list[Finding]:
    """What the excitation lacks; one finding per joint."""
    return [_of_base(row) if row.joint in base else _judged(row) for row in rows]


def _of_base(row: Excitation) -> Finding:
    """A base has no motor: it moves by what the others do, and not for long."""
    if row.moving < LEAST_OF_BASE:
        what = f'{row.joint} moves in {100 * row.moving:.1f} % of the time only'
        return Finding('still', WARNING, what, (), 'record the robot stepping or walking too')
    return _moves(row)


def _joint(recordings: Sequence[Recording], sigma: Array, j: int) -> Excitation:
    name, episodes = recordings[0].joints[j], [e for r in recordings for e in r.episodes]
    joints = len(recordings[0].joints)
    q, dq = (np.concatenate([getattr(e, n)[:, j] for e in episodes]) for n in ('q', 'dq'))
    moving = np.concatenate(
        [
            np.abs(e.dq[:, j]) > MOVING_SIGMAS * s[joints + j]
            for r, s in zip(recordings, sigma, strict=True)
            for e in r.episodes
        ]
    )
    u, free = _input(recordings, name)
    return Excitation(
        joint=name,
        angle=(float(q.min()), float(q.max())),
        rate=(float(dq.min()), float(dq.max())),
        input=(float(u.min()), float(u.max())) if u.size else None,
        unit=INPUT_UNITS.get(recordings[0].input, 'V'),
        levels=len(np.unique(np.round(u, 6))),
        moving=float(moving.mean()),
        forward=float((dq[moving] > 0).mean()) if moving.any() else 0.0,
        free=free,
    )


def _input(recordings: Sequence[Recording], joint: str) -> tuple[Array, float]:
    """Inputs of a joint's motor over all bags, and the time it was free [s]."""
    if joint not in recordings[0].actuators:
        return np.zeros(0), 0.0
    a = recordings[0].actuators.index(joint)
    episodes = [e for r in recordings for e in r.episodes]
    free = sum(float(np.diff(e.t)[~e.enabled[:-1, a]].sum()) for e in episodes)
    return np.concatenate([e.inputs[:, a] for e in episodes]), free


def _judged(row: Excitation) -> Finding:
    if row.moving < LEAST_MOVING:
        what = f'{row.joint} moves in {100 * row.moving:.0f} % of the time only'
        todo = 'record 20 s with an input that swings it, such as steps of random size'
        return Finding('still', WARNING, what, (), todo)
    if min(row.forward, 1 - row.forward) < ONE_WAY:
        what = f'{row.joint} turns one way only: friction and a constant torque look alike'
        return Finding('one_way', WARNING, what, (), 'let it turn both ways')
    if row.input and row.levels < FEWEST_LEVELS and not row.free:
        what = f'the input of {row.joint} has {row.levels} levels: its motor law hardly shows'
        return Finding('few_levels', WARNING, what, (), 'vary the size of the input')
    return _moves(row)


def _moves(row: Excitation) -> Finding:
    return Finding('excitation', OK, f'{row.joint} moves in {100 * row.moving:.0f} % of the time')
