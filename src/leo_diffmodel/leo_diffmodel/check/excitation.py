# SPDX-License-Identifier: Apache-2.0
"""What each joint was put through: ranges, inputs, motion, time free, and noise against that."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np

from leo_diffmodel.bags.recording import Recordings
from leo_diffmodel.check.settings import CHECK
from leo_diffmodel.compare.sizes import input_unit, length_unit
from leo_diffmodel.compare.windows import Array
from leo_diffmodel.outside.finding import Finding, OK, WARNING
from leo_sim.description.robot import Robot


@dataclass(frozen=True)
class Excitation:
    joint: str
    angle: tuple[float, float]  # lowest and highest
    rate: tuple[float, float]  # lowest and highest
    angle_unit: str  # rad, or m on a slide; that of the rate is by the second
    input: tuple[float, float] | None  # lowest and highest applied; None without a motor
    unit: str  # of the input
    levels: int  # number of different inputs, 0 without a motor
    moving: float  # share of the time in which the rate stands out of its noise
    forward: float  # share of the moving time in which the angle grows
    free: float  # time with its motor off [s]


def excitation(recordings: Recordings, sigma: Array, robot: Robot) -> list[Excitation]:
    """One row per joint; those of a base that was held in all bags have none. Noise is (R, 2J)."""
    loose = _loose(recordings, robot.base_joints)
    return [_joint([recordings[i] for i in used], sigma[used], j, robot) for j, used in loose]


def _loose(recordings: Recordings, base: Sequence[str]) -> Iterator[tuple[int, list[int]]]:
    for j, name in enumerate(recordings[0].joints):
        used = [i for i, r in enumerate(recordings) if not (r.held and name in base)]
        if used:
            yield j, used


def judge(rows: Sequence[Excitation], base: Sequence[str] = ()) -> list[Finding]:
    """What the excitation lacks; one finding per joint."""
    return [_of_base(row) if row.joint in base else _judged(row) for row in rows]


def _of_base(row: Excitation) -> Finding:
    """A base has no motor: it moves by what the others do, and not for long."""
    if row.moving < CHECK.least_of_base:
        what = f'{row.joint} moves in {100 * row.moving:.1f} % of the time only'
        return Finding('still', WARNING, what, 'record the robot stepping or walking too')
    return _moves(row)


def _joint(recordings: Recordings, sigma: Array, j: int, robot: Robot) -> Excitation:
    name, episodes = recordings[0].joints[j], [e for r in recordings for e in r.episodes]
    noise = sigma[:, len(recordings[0].joints) + j]
    q, dq = (np.concatenate([getattr(e, n)[:, j] for e in episodes]) for n in ('q', 'dq'))
    each = [(e, s) for r, s in zip(recordings, noise, strict=True) for e in r.episodes]
    moving = np.concatenate([np.abs(e.dq[:, j]) > CHECK.moving_sigmas * s for e, s in each])
    u, free = np.zeros(0), 0.0
    if name in recordings[0].actuators:
        a = recordings[0].actuators.index(name)
        u = np.concatenate([e.inputs[:, a] for e in episodes])
        free = sum(float(np.diff(e.t)[~e.enabled[:-1, a]].sum()) for e in episodes)
    return Excitation(
        joint=name,
        angle=(float(q.min()), float(q.max())),
        rate=(float(dq.min()), float(dq.max())),
        angle_unit=length_unit(robot, name),
        input=(float(u.min()), float(u.max())) if u.size else None,
        unit=input_unit(robot, name),
        levels=len(np.unique(np.round(u, 6))),
        moving=float(moving.mean()),
        forward=float((dq[moving] > 0).mean()) if moving.any() else 0.0,
        free=free,
    )


def _judged(row: Excitation) -> Finding:
    if row.moving < CHECK.least_moving:
        what = f'{row.joint} moves in {100 * row.moving:.0f} % of the time only'
        todo = 'record 20 s with an input that swings it, such as steps of random size'
        return Finding('still', WARNING, what, todo)
    if min(row.forward, 1 - row.forward) < CHECK.one_way:
        what = f'{row.joint} moves one way only: friction and a constant torque look alike'
        return Finding('one_way', WARNING, what, 'let it move both ways')
    if row.input and row.levels < CHECK.fewest_levels and not row.free:
        what = f'the input of {row.joint} has {row.levels} levels: its motor law hardly shows'
        return Finding('few_levels', WARNING, what, 'vary the size of the input')
    return _moves(row)


def _moves(row: Excitation) -> Finding:
    return Finding('excitation', OK, f'{row.joint} moves in {100 * row.moving:.0f} % of the time')


def noise_level(recordings: Recordings, sigma: Array, robot: Robot) -> list[Finding]:
    """One finding per joint: the noisiest of its bags (R, 2J) against what it moves in all."""
    joints, out = recordings[0].joints, []
    for j, used in _loose(recordings, robot.base_joints):
        largest = sigma[used][:, [j, len(joints) + j]].max(axis=0)
        episodes = [e for i in used for e in recordings[i].episodes]
        moved = [np.concatenate([getattr(e, n)[:, j] for e in episodes]) for n in ('q', 'dq')]
        swing = np.array([moved[0].std(), np.sqrt((moved[1] ** 2).mean())])
        out.append(_noise(joints[j], largest, swing, length_unit(robot, joints[j])))
    return out


def _noise(joint: str, sigma: Array, swing: Array, unit: str) -> Finding:
    """Noise (2,) of position and rate against the position's spread and the rms rate (2,)."""
    noise = f'noise {sigma[0]:.2g} {unit} and {sigma[1]:.2g} {unit}/s rms'
    share = float((sigma / np.maximum(swing, 1e-12)).max())
    if (swing <= sigma).all():
        what = f'{joint} does not move: all that shows is {noise}'
    elif share > 1:
        what = f'{joint}: {noise}, more than what it moves'
    else:
        what = f'{joint}: {noise}, at most {100 * share:.1f} % of what it moves'
    if share <= CHECK.noisy:
        return Finding('noise', OK, what)
    todo = 'move further and faster, or record the encoder rather than a filtered estimate'
    return Finding('noise', WARNING, what, todo)
