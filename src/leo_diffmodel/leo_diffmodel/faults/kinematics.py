# SPDX-License-Identifier: Apache-2.0
"""Faults that angle and speed of a joint show by themselves, without any model."""

from collections.abc import Iterator
from dataclasses import dataclass
from functools import partial

import numpy as np

from leo_diffmodel.bags.recording import Episode, Recording
from leo_diffmodel.faults.catalogue import FAULTS
from leo_diffmodel.faults.found import Found
from leo_diffmodel.faults.motion import Channels, coarse, Law, Motion
from leo_diffmodel.faults.settings import LIMITS
from leo_diffmodel.outside.finding import ERROR, graded
from leo_diffmodel.outside.samples import resolution

_found = partial(Found, evidence='kinematics')
BY = {'speed_late': 'by a delay', 'speed_filter': 'by a filter'}


@dataclass(frozen=True)
class Relation:
    """How the logged speed of a joint follows its logged angle."""

    law: Law  # scale, lateness, filter and zero, with their covariance
    kind: str  # `speed_late` or `speed_filter`, whichever fits better
    sure: bool  # whether it does so clearly
    period: float  # of the samples [s]
    speed: float  # rms of the true speed [rad/s]
    grain: float  # step of the speed's sensor [rad/s]
    usual: float  # mean size of the logged speed [rad/s]

    @property
    def rounded(self) -> float:
        """What a speed that is rounded towards zero, or away from it, changes the scale by."""
        return 0.5 * self.grain / max(self.usual, 1e-12) * abs(float(self.law.theta[0]))

    @property
    def right_unit(self) -> bool:
        """Whether the speed is surely that of the angle, no multiple of it."""
        (scale, sd), (low, high) = self.law.of('scale'), FAULTS['speed_scale'].harmless
        half = LIMITS.sigmas * sd
        return low <= scale - half and scale + half <= high

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
    channels = (np.concatenate([getattr(p, n) for p in parts]) for n in ('q', 'dq'))
    if not parts or not all(np.ptp(channel) > 0 for channel in channels):
        return None
    motion = Motion(parts)
    if not all(motion.signals > LIMITS.signal):
        return None
    law, kind, sure = _simplest(motion, motion.tuned(coarse(parts, motion.period)))
    scale, sd = law.of('scale')
    away = max(abs(scale), 1 / max(abs(scale), 1e-300)) >= LIMITS.largest_scale
    late = np.abs(law.theta[1:3]).max() >= LIMITS.reach
    if away or late or sd > LIMITS.clear_scale * abs(scale):
        return None
    speed = float(np.sqrt(np.mean((motion.dq - law.theta[3]) ** 2))) / abs(scale)
    usual = float(np.abs(motion.dq - law.theta[3]).mean())
    grain = resolution(motion.dq, quantile=LIMITS.grain)
    return Relation(law, kind, sure, motion.period, speed, grain, usual)


def kinematic_faults(relation: Relation, joint: str, unit: str) -> list[Found]:
    """What is wrong with a joint's speed, in that unit, or with its angle: both may be."""
    return [*_scales(relation, joint), *_zero(relation, joint, unit), *_late(relation, joint)]


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
    if late * tau > 0 and law.loss - full.loss > LIMITS.kind_nats:
        return full, kind, False
    apart = abs(found['speed_late'].loss - found['speed_filter'].loss) > LIMITS.kind_nats
    return law, kind, apart


def _scales(relation: Relation, joint: str) -> Iterator[Found]:
    scale, sd = relation.law.of('scale')
    if scale < 0:
        what = f'the logged speed of {joint} has the other sign than the change of its angle'
        yield _found('speed_sign', ERROR, what, joint=joint, value=-1.0, sd=sd)
    low, high = FAULTS['speed_scale'].harmless
    if outside(abs(scale), LIMITS.shows * sd + relation.rounded, low, high):
        what = f'the logged speed of {joint} is {abs(scale):.4g} ± {LIMITS.sigmas * sd:.2g} times '
        what += 'the change of its angle'
        yield _found('speed_scale', ERROR, what, joint=joint, value=abs(scale), sd=sd)


def _zero(relation: Relation, joint: str, unit: str) -> Iterator[Found]:
    zero, sd = relation.law.of('zero')
    most = FAULTS['speed_zero'].harmless[1] * relation.speed * abs(relation.law.theta[0])
    if abs(zero) > max(most, relation.grain) + LIMITS.shows * sd:
        figure = f'{zero:.3g} ± {LIMITS.sigmas * sd:.1g} {unit}'
        what = f'the logged speed of {joint} is {figure} where it stands'
        yield _found('speed_zero', ERROR, what, joint=joint, value=zero, sd=sd)


def _late(relation: Relation, joint: str) -> Iterator[Found]:
    late, sd = relation.late
    least = max(LIMITS.least_late, LIMITS.late_periods * relation.period)
    if abs(late) < least + LIMITS.shows * sd:
        return
    by = BY[relation.kind] if relation.sure else 'by a delay or a filter'
    frames = late / relation.period
    whole = abs(round(frames)) >= 1 and abs(frames - round(frames)) < LIMITS.whole_row
    rows = f', {abs(round(frames))} rows' if whole else ''
    way = 'late' if late > 0 else 'early'
    what = f'the logged speed of {joint} is {abs(1e3 * late):.1f} ± '
    what += f'{1e3 * LIMITS.sigmas * sd:.1g} ms {way} against its angle, {by}{rows}'
    kinds = [relation.kind] if relation.sure else [*BY]
    error = all(outside(late, LIMITS.sigmas * sd, *FAULTS[kind].harmless) for kind in kinds)
    yield _found(relation.kind, graded(error), what, joint=joint, value=late, sd=sd)


def _stretches(recording: Recording, j: int) -> list[Channels]:
    """The stretches in which the joint moves most, thinned, each of some seconds."""
    parts = [p for e in recording.episodes for p in _cut(e, j)]
    parts.sort(key=lambda p: -float(np.ptp(p.q)))
    before = np.cumsum([0, *(len(p.t) for p in parts[:-1])])
    taken = [p for p, count in zip(parts, before, strict=False) if count < LIMITS.most_samples]
    return sorted(taken, key=lambda p: p.t[0])


def _cut(e: Episode, j: int) -> Iterator[Channels]:
    every = max(1, int(1 / (LIMITS.fastest * e.period)))
    t, q, dq = (x[::every] for x in (e.t, e.q[:, j], e.dq[:, j]))
    count = max(LIMITS.fewest, round(LIMITS.stretch / (every * e.period)))
    for k in range(max(1, len(t) // count)):
        rows = slice(k * count, (k + 1) * count if k < len(t) // count - 1 else None)
        if len(t[rows]) >= LIMITS.fewest:
            yield Channels(t[rows], q[rows], dq[rows])
