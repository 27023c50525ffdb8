# SPDX-License-Identifier: Apache-2.0
"""Faults that angle and speed of a joint show by themselves, without any model."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from leo_diffmodel.bags.recording import Episode, Recording
from leo_diffmodel.faults.base import Found
from leo_diffmodel.faults.catalogue import FAULTS
from leo_diffmodel.faults.motion import Channels, coarse, Law, Motion, REACH

Array = np.ndarray
FASTEST = 200.0
"""Hz: every so many samples are taken of what comes more often."""
STRETCH, MOST = 2.0, 1600
"""s; samples: the stretches that move most are looked at, up to so many samples in all."""
FEWEST = 60
"""Samples that a stretch must have."""
CLEAR = 0.1
"""Of the scale: the largest standard deviation with which anything is said."""
TOLD_APART = 5.0
"""Nats by which a delay must fit better than a filter, or worse, to be told from it."""
SIGMAS = 1.96
"""Of an interval."""
SHOWS = 3.0
"""Standard deviations from which on a size shows at all."""


@dataclass(frozen=True)
class Relation:
    """How the logged speed of a joint follows its logged angle.

    Attributes:
        law: scale, lateness, filter and zero, with their covariance.
        kind: `speed_late` or `speed_filter`, whichever fits better.
        sure: whether it does so clearly.
        period: of the samples [s].
        speed: rms of the true speed [rad/s].
        grain: step of the speed's sensor [rad/s].
        usual: mean size of the logged speed [rad/s].
    """

    law: Law
    kind: str
    sure: bool
    period: float
    speed: float
    grain: float
    usual: float

    @property
    def rounded(self) -> float:
        """What a speed that is rounded towards zero, or away from it, changes the scale by."""
        return 0.5 * self.grain / max(self.usual, 1e-12) * abs(float(self.law.theta[0]))

    @property
    def late(self) -> tuple[float, float]:
        """Delay and filter together [s], with the standard deviation."""
        sd = float(np.sqrt(self.law.covariance[1:3, 1:3].sum()))
        return float(self.law.theta[1] + self.law.theta[2]), sd


def relate(recording: Recording, j: int) -> Relation | None:
    """The relation of one joint; None where it hardly moves or no speed was measured."""
    if recording.rates != 'measured':
        return None
    parts = _stretches(recording, j)
    if not parts or not all(
        np.ptp(np.concatenate([getattr(p, n) for p in parts])) > 0 for n in ('q', 'dq')
    ):
        return None
    motion = Motion(parts)
    full = motion.tuned(coarse(parts, motion.period))
    law, kind, sure = _simplest(motion, full)
    scale, sd = law.of('scale')
    if sd > CLEAR * abs(scale) or np.abs(law.theta[1:3]).max() >= REACH:
        return None
    speed = float(np.sqrt(np.mean((motion.dq - law.theta[3]) ** 2))) / abs(scale)
    step = np.abs(np.diff(motion.dq))
    grain = float(np.quantile(step[step > 0], 0.02)) if step.any() else 0.0
    usual = float(np.abs(motion.dq - law.theta[3]).mean())
    return Relation(law, kind, sure, motion.period, speed, grain, usual)


def kinematic_faults(relation: Relation, joint: str) -> list[Found]:
    """What is wrong with the speed of a joint, or with its angle: the kinematics cannot tell."""
    return [*_scales(relation, joint), *_zero(relation, joint), *_late(relation, joint)]


def outside(value: float, half: float, low: float, high: float) -> bool:
    """Whether an interval of half width `half` about a value lies outside low to high."""
    return value - half > high or value + half < low


def _simplest(motion: Motion, full: Law) -> tuple[Law, str, bool]:
    """A delay or a filter, which of them, and whether that is clear; both where both are."""
    scale, late, tau, zero = full.theta
    both = late + tau
    found = {
        'speed_late': motion.fit(('scale', 'late', 'zero'), np.array([scale, both, 0, zero])),
        'speed_filter': motion.fit(('scale', 'filter', 'zero'), np.array([scale, 0, both, zero])),
    }
    kind = min(found, key=lambda k: found[k].loss)
    law = found[kind]
    if late * tau > 0 and law.loss - full.loss > TOLD_APART:
        return full, kind, False
    apart = abs(found['speed_late'].loss - found['speed_filter'].loss) > TOLD_APART
    return law, kind, apart


def _scales(relation: Relation, joint: str) -> Iterator[Found]:
    scale, sd = relation.law.of('scale')
    if scale < 0:
        what = f'the logged speed of {joint} has the other sign than the change of its angle'
        yield Found(FAULTS['speed_sign'], joint, -1.0, sd, what, True, 'kinematics')
    low, high = FAULTS['speed_scale'].harmless
    if outside(abs(scale), SHOWS * sd + relation.rounded, low, high):
        what = (
            f'the logged speed of {joint} is {abs(scale):.4g} ± {SIGMAS * sd:.2g} times the '
            'change of its angle'
        )
        yield Found(FAULTS['speed_scale'], joint, abs(scale), sd, what, True, 'kinematics')


def _zero(relation: Relation, joint: str) -> Iterator[Found]:
    zero, sd = relation.law.of('zero')
    fault = FAULTS['speed_zero']
    most = max(fault.harmless[1] * relation.speed * abs(relation.law.theta[0]), relation.grain)
    if abs(zero) > most + SHOWS * sd:
        what = (
            f'the logged speed of {joint} is {zero:.3g} ± {SIGMAS * sd:.1g} rad/s where it stands'
        )
        yield Found(fault, joint, zero, sd, what, True, 'kinematics')


def _late(relation: Relation, joint: str) -> Iterator[Found]:
    late, sd = relation.late
    trifle = max(LEAST_LATE, LATE_PERIODS * relation.period)
    if abs(late) < trifle + SHOWS * sd:
        return
    by = BY[relation.kind] if relation.sure else 'by a delay or a filter'
    frames = late / relation.period
    rows = f', {abs(round(frames))} rows' if _whole(frames) else ''
    way = 'late' if late > 0 else 'early'
    what = (
        f'the logged speed of {joint} is {abs(1e3 * late):.1f} ± {1e3 * SIGMAS * sd:.1g} ms '
        f'{way} against its angle, {by}{rows}'
    )
    kinds = [relation.kind] if relation.sure else [*BY]
    error = all(outside(late, SIGMAS * sd, *FAULTS[kind].harmless) for kind in kinds)
    yield Found(FAULTS[relation.kind], joint, late, sd, what, error, 'kinematics')


BY = {'speed_late': 'by a delay', 'speed_filter': 'by a filter'}
LEAST_LATE, LATE_PERIODS = 0.002, 0.5
"""s; periods: what happens between two samples, as after a step of the voltage, looks like a
lag so long."""
WHOLE = 0.1
"""Of a row: how near a whole number of rows a lateness is that is told so."""


def _whole(frames: float) -> bool:
    return abs(round(frames)) >= 1 and abs(frames - round(frames)) < WHOLE


def _stretches(recording: Recording, j: int) -> list[Channels]:
    """The stretches in which the joint moves most, thinned, each of some seconds."""
    parts = [p for e in recording.episodes for p in _cut(e, j)]
    parts.sort(key=lambda p: -float(np.ptp(p.q)))
    taken, count = [], 0
    for part in parts:
        if count >= MOST:
            break
        taken.append(part)
        count += len(part.t)
    return sorted(taken, key=lambda p: p.t[0])


def _cut(e: Episode, j: int) -> Iterator[Channels]:
    period = float(np.median(np.diff(e.t)))
    every = max(1, int(1 / (FASTEST * period)))
    t, q, dq = (x[::every] for x in (e.t, e.q[:, j], e.dq[:, j]))
    count = max(FEWEST, round(STRETCH / (every * period)))
    for k in range(max(1, len(t) // count)):
        rows = slice(k * count, (k + 1) * count if k < len(t) // count - 1 else None)
        if len(t[rows]) >= FEWEST:
            yield Channels(t[rows], q[rows], dq[rows])
