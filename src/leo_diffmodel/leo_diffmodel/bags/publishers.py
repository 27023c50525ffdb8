# SPDX-License-Identifier: Apache-2.0
"""Several publishers on one topic of joint states, which frame_id and names of joints tell apart.

Two halves of a robot, each with its own joints, are joined by time. Of two that publish the same
joints one is read. Two that no message tells apart are refused, as their states alternate.
"""

from collections.abc import Sequence
from itertools import combinations
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from leo_msgs_py.errors import UserError

from .types import Floats, Stamps

FEWEST = 3  # messages of a publisher; fewer are damaged ones, or latched
NEAR = 1.5  # periods of a half from one of its states to the next: across more nothing is made up
SWITCHES = 0.2  # share of the states where two take turns; a gap, reset or jump is one state
APART = 0.02  # rad (m): the least that two are apart, above any encoder's resolution
NEARER = 10.0  # times: so much nearer than the last state is one before it where two take turns
FASTER = 3.0  # times the larger speed at both ends: no joint goes farther in a step
FEWEST_TURNS = 20  # states that show whether two take turns or joints jump


class Part(NamedTuple):
    """What one publisher sent, which its frame_id and its names of joints tell from others.

    Times [ns] have shape (T,). Positions, velocities and efforts have shape (T, J) in our order,
    NaN but for the columns `ours`; None where no message has one.
    """

    frame: str
    names: tuple[str, ...]
    ours: tuple[int, ...]
    log: Stamps
    published: Stamps
    stamp: Stamps
    fields: tuple[Floats | None, ...]

    @property
    def rate(self) -> float:
        seconds = (self.log[-1] - self.log[0]) * 1e-9
        return (len(self.log) - 1) / seconds if seconds > 0 else 0.0


def together(
    parts: Sequence[Part], joints: Sequence[str], topic: str
) -> tuple[Part, tuple[str, ...]] | None:
    """All joints' states and notes on several publishers; None where a joint is in no message."""
    found = sorted((p for p in parts if p.ours), key=lambda part: len(part.log), reverse=True)
    whole = [part for part in found if len(part.ours) == len(joints)]
    return _one(whole, joints, topic) if whole else _joined(found, joints, topic)


def _one(parts: list[Part], joints: Sequence[str], topic: str) -> tuple[Part, tuple[str, ...]]:
    """The publisher with the most messages, with those that spoke before or after it."""
    rivals = [part for part in parts[1:] if _overlap(parts[0], part)]
    others = [part for part in parts[1:] if not _overlap(parts[0], part)]
    made = _concatenated([parts[0], *others])
    _refuse_turns(made, joints, topic)
    return made, (_second([parts[0], *rivals], joints, topic),) if rivals else ()


def _concatenated(parts: list[Part]) -> Part:
    log = np.concatenate([part.log for part in parts])
    order = np.argsort(log, kind='stable')
    published = np.concatenate([part.published for part in parts])[order]
    stamp = np.concatenate([part.stamp for part in parts])[order]
    fields: list[Floats | None] = []
    for columns in zip(*(part.fields for part in parts), strict=True):
        width = next((column.shape[1] for column in columns if column is not None), None)
        whole = [
            np.full((len(part.log), width or 0), np.nan) if column is None else column
            for part, column in zip(parts, columns, strict=True)
        ]
        fields.append(None if width is None else np.concatenate(whole)[order])
    return parts[0]._replace(
        log=log[order], published=published, stamp=stamp, fields=tuple(fields)
    )


def _joined(
    parts: list[Part], joints: Sequence[str], topic: str
) -> tuple[Part, tuple[str, ...]] | None:
    """Halves of a robot: each joint from who says it most often, at the times of the fastest."""
    source = {j: part for part in reversed(parts) for j in part.ours}
    if len(source) < len(joints):
        return None
    used = [part for part in parts if any(part is s for s in source.values())]
    columns = [[j for j, s in source.items() if s is part] for part in used]
    words = []
    for half, own in zip(used, columns, strict=True):
        only = half._replace(fields=tuple(f if f is None else f[:, own] for f in half.fields))
        _refuse_turns(only, [joints[j] for j in own], topic)
        words.append(f'{", ".join(joints[j] for j in sorted(own))} at {half.rate:.3g} Hz')
    doubled = [
        [a, b] for a, b in combinations(parts, 2) if set(a.ours) & set(b.ours) and _overlap(a, b)
    ]
    return _at_the_fastest(used, columns), (
        *(_second(pair, joints, topic) for pair in doubled),
        f'{len(used)} publishers on {topic} have a part of the joints each ({"; ".join(words)}); '
        'joined by time, the slower ones interpolated',
    )


def _overlap(a: Part, b: Part) -> bool:
    if min(len(a.log), len(b.log)) < FEWEST:
        return False
    return bool(a.log[0] < b.log[-1] and b.log[0] < a.log[-1])


def _second(parts: list[Part], joints: Sequence[str], topic: str) -> str:
    common = set.intersection(*(set(part.ours) for part in parts))
    words = ' and '.join(
        f'frame_id {p.frame!r} with {len(p.names)} joint{"s" * (len(p.names) > 1)} at '
        f'{p.rate:.3g} Hz'
        for p in parts
    )
    return (
        f'{len(parts)} publishers of {", ".join(joints[j] for j in sorted(common))} on {topic}: '
        f'{words}; the first is read (frame_id: in a topic map chooses another)'
    )


def _at_the_fastest(parts: list[Part], columns: list[list[int]]) -> Part:
    """The columns of all halves at the times of the first, where each says something near."""
    clock, base = _clock(parts), parts[0]
    t = getattr(base, clock)
    shape, known = (len(t), sum(map(len, columns))), np.ones(len(t), dtype=bool)
    absent = [all(half.fields[k] is None for half in parts) for k in range(3)]
    fields = [None if nowhere else np.full(shape, np.nan) for nowhere in absent]
    for half, own in zip(parts, columns, strict=True):
        at = getattr(half, clock)
        known &= True if half is base else _near(t, at)
        for whole, values in zip(fields, half.fields, strict=True):
            if whole is not None and values is not None:
                part = values[:, own]
                whole[:, own] = part if half is base else _at(t, at, part)
    return base._replace(
        log=base.log[known],
        published=base.published[known],
        stamp=base.stamp[known],
        fields=tuple(None if f is None else f[known] for f in fields),
    )


def _clock(parts: list[Part]) -> str:
    """`stamp` where all stamps go forward on one clock, by the time they took; else `log`."""
    if any((np.diff(half.stamp) < 0).any() or not half.stamp.any() for half in parts):
        return 'log'
    delays = [float(np.median(half.log - half.stamp)) for half in parts]
    steps = [float(np.median(np.diff(half.log))) if len(half.log) > 1 else 0.0 for half in parts]
    return 'log' if np.ptp(delays) > max(steps) else 'stamp'


def _at(t: Stamps, own: Stamps, values: Floats) -> Floats:
    at, x = (t - own[0]).astype(float), (own - own[0]).astype(float)
    return np.column_stack([np.interp(at, x, column) for column in values.T])


def _near(t: Stamps, own: Stamps) -> NDArray[np.bool_]:
    """Say which times [ns] (T,) lie between two states of a half (N,) that follow each other."""
    if len(own) < 2:
        return np.isin(t, own)
    after = np.searchsorted(own, t)
    last = np.clip(after, 1, len(own) - 1)
    steps = np.diff(own)
    follow = steps[last - 1] <= NEAR * float(np.median(steps))
    return np.asarray(((after > 0) & (after < len(own)) & follow) | np.isin(t, own))


def _refuse_turns(made: Part, joints: Sequence[str], topic: str) -> None:
    q = made.fields[0]
    if q is None or len(q) < FEWEST_TURNS:
        return
    back = float(np.mean(np.diff(made.stamp) < 0))
    apart = _apart(q) & ~_moved(made, q)
    if max(back, float(apart.mean(axis=0).max())) <= SWITCHES:
        return
    j = int(apart.sum(axis=0).argmax())
    step = np.abs(np.diff(q[:, j], axis=0))[3:][apart[:, j]]
    what = (
        f'values of {joints[j]} {np.median(step):.2g} apart in {apart[:, j].mean():.0%}'
        if step.size
        else f'stamps that go back in {back:.0%}'
    )
    raise UserError(
        f'two publishers take turns on {topic} ({what} of the steps), and neither frame_id nor '
        'names tell them apart; record again with one of them, or each on its own topic'
    )


def _moved(made: Part, q: Floats) -> NDArray[np.bool_]:
    """Say which of these steps the joint made by its own speed, as one that chatters does."""
    dq = made.fields[1]
    if dq is None:
        return np.zeros(q[4:].shape, dtype=bool)
    seconds = np.abs(np.diff(made.stamp))[3:, None] * 1e-9
    speed = np.fmax(np.abs(dq[4:]), np.abs(dq[3:-1]))
    return np.asarray(np.abs(q[4:] - q[3:-1]) < FASTER * speed * seconds)


def _apart(q: Floats) -> NDArray[np.bool_]:
    """Say which steps, from the fifth state on (T - 4, J), go to where the states before were."""
    last = np.abs(q[4:] - q[3:-1])
    before = np.min([np.abs(q[4:] - q[4 - k : -k]) for k in (2, 3, 4)], axis=0)
    return np.asarray((last > APART) & (last > NEARER * before))
