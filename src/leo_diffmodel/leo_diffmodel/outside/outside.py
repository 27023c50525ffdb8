# SPDX-License-Identifier: Apache-2.0
"""What in a recording is not the robot: shoves, hands, stops, frozen sensors, gaps."""

from collections.abc import Iterable, Sequence
from itertools import pairwise

import numpy as np

from leo_diffmodel.bags.episode import kept, merged, Span
from leo_diffmodel.bags.recording import Recording, Recordings
from leo_diffmodel.outside.finding import Finding
from leo_diffmodel.outside.flow import Flow, flow, still_rates
from leo_diffmodel.outside.forces import blocked, bursts, held, stretch
from leo_diffmodel.outside.frozen import frozen
from leo_diffmodel.outside.ordinary import explained, follows, Law, ordinary, strongest_wave
from leo_diffmodel.outside.rate import with_true_rates
from leo_diffmodel.outside.resonance import resonance
from leo_diffmodel.outside.samples import Array
from leo_diffmodel.outside.settings import OUTSIDE
from leo_sim.model import Model

FORCES = ('push', 'hand', 'blocked', 'unexplained')
"""The kinds of stretches in which the robot is moved, or stopped."""


@np.errstate(all='ignore')
def moved_from_outside(recording: Recording, model: Model) -> list[Finding]:
    """Where somebody else moves or holds the robot: one stretch in each finding, in order of time.

    Codes are `push` (short), `hand` (lasting), `blocked` and `held`; `unexplained` where the motor
    acts by itself and the joint does not do what model, motor and friction can.

    The torque that the model lacks is explained, joint by joint, by `ordinary` effects. What
    stands far out of the rest for a moment is a push; where a large part is left over nearly
    always, a hand did the work. A robot on the ground is only asked whether it was held at first.
    """
    model = model.of_recordings((recording.name,))
    true = with_true_rates(recording)
    found = held(true, model)
    if (seen := flow(true, model)) is not None:
        joints = range(len(model.robot.base_joints), len(recording.joints))
        found += [f for j in joints for f in _at_joint(true, seen, j)]
    return sorted(found, key=lambda f: f.where[0][0])


def share_outside(recordings: Recordings, found: Sequence[Sequence[Finding]]) -> float:
    """Share of the moving time, 0 to 1, that is in pushes, hands and blocked joints of each."""
    total = outside = 0.0
    for recording, stretches in zip(recordings, found, strict=False):
        true = with_true_rates(recording)
        still = still_rates(true)
        spans = _spans(f for f in stretches if f.code in FORCES)
        for e in true.episodes:
            step = np.diff(e.t)
            inside = _within(e.t[:-1], spans)
            moving = (np.abs(e.dq[:-1]) > still).any(axis=1) | inside
            total += float(step[moving].sum())
            outside += float(step[inside].sum())
    return outside / total if total else 0.0


def without(recordings: Recordings, found: Sequence[Sequence[Finding]]) -> list[Recording]:
    """The recordings with the stretches found in each cut out, 0.1 s before and after them too.

    Pieces shorter than 0.5 s are dropped, and recordings of which nothing remains.
    """
    out = []
    for recording, stretches in zip(recordings, found, strict=True):
        spans = _cuts(_spans(stretches))
        pieces = kept(recording, spans, OUTSIDE.least_piece) if spans else recording
        out += [] if pieces is None else [pieces]
    return out


def not_the_robot(recording: Recording, model: Model) -> list[Span]:
    """All that is to be cut out of a recording [s], frozen sensors and gaps too, as `_cuts`."""
    forces = _spans(moved_from_outside(recording, model))
    return _cuts([*forces, *(s for f in frozen(recording) for s in f.spans), *_gaps(recording)])


def _cuts(spans: Iterable[Span]) -> list[Span]:
    """Stretches of time of one recording with their margins, in order and apart."""
    wide = [(begin - OUTSIDE.margin, end + OUTSIDE.margin) for begin, end in spans]
    return list(merged(wide, OUTSIDE.least_piece))


def _spans(found: Iterable[Finding]) -> list[Span]:
    return [span for f in found for span in f.where]


def _within(t: Array, spans: Iterable[Span]) -> Array:
    inside = np.zeros(len(t), dtype=bool)
    for begin, end in spans:
        inside |= (t >= begin) & (t <= end)
    return inside


def _gaps(recording: Recording) -> list[Span]:
    """Between episodes that a gap parts, and within episodes where samples are missing."""
    limit = max(OUTSIDE.gap_periods * recording.state_period, OUTSIDE.gap_seconds)
    parted = any('gaps; split there' in w for w in recording.warnings)
    edges = [(float(a.t[-1]), float(b.t[0])) for a, b in pairwise(recording.episodes) if parted]
    inner = [
        (float(e.t[k]), float(e.t[k + 1]))
        for e in recording.episodes
        for k in np.flatnonzero(np.diff(e.t) > limit)
    ]
    return [(a, b) for a, b in (*edges, *inner) if b - a > limit]


def _at_joint(recording: Recording, seen: Flow, j: int) -> list[Finding]:
    fitted = seen.moving[:, j] > 0.5
    if fitted.sum() < OUTSIDE.fewest_instants:
        return []
    stronger = Law(seen.motor[:, j], OUTSIDE.weaker, np.inf)
    laws = [*ordinary(seen, j), stronger]
    found = explained(seen, j, fitted, laws)
    pushes = bursts(seen, found.rest, j, fitted)
    led = _led(seen, laws, found.rest, j, fitted)
    rung = resonance(recording, j) if led or pushes else None
    if led and follows(seen, j):
        why = 'is led by a hand: no motor, weight or friction gives what accelerates it'
        return _all_of(seen, 'hand', f'{seen.joint(j)}: {why}')
    if led or rung:
        return _all_of(seen, 'unexplained', _unlike(seen, found.rest, j, rung))
    return [*pushes, *blocked(seen, found, j, fitted)]


def _led(seen: Flow, laws: list[Law], rest: Array, j: int, fitted: Array) -> bool:
    """Whether a hand leads the joint: nothing the robot has gives what sets it in motion.

    What lasts of the torque left over is compared with what motor and weight leave of each other,
    or what the accelerations take. Where a motor acts by itself a torque that comes and goes like
    a clock is a law.
    """
    if fitted.sum() * float(np.median(np.diff(seen.time))) < OUTSIDE.least_led:
        return False
    size, free = _lasting(rest, fitted), np.abs(seen.motor + seen.load)
    if size <= OUTSIDE.hand * np.maximum(free, np.abs(seen.turning))[fitted, j].mean():
        return False
    if follows(seen, j):
        return True
    waving = explained(seen, j, fitted, [*laws, *strongest_wave(seen.time, rest, fitted)])
    return _lasting(waving.rest, fitted) > OUTSIDE.one_wave * size


def _lasting(rest: Array, fitted: Array) -> float:
    """Typical size of the rest that is still there one bell later: noise and jerks are not."""
    most, bell = float(np.quantile(np.abs(rest[fitted]), 0.9)), OUTSIDE.per_bell
    short = np.clip(rest, -most, most)
    both = fitted[bell:] & fitted[:-bell]
    if not both.any():
        return 0.0
    again = float((short[bell:] * short[:-bell])[both].mean())
    return OUTSIDE.mean_of_rms * max(again, 0.0) ** 0.5


def _unlike(seen: Flow, rest: Array, j: int, rung: float | None) -> str:
    """What is not like the model at a joint whose motor acts by itself, in words."""
    joint, size = seen.joint(j), f'{_lasting(rest, seen.moving[:, j] > 0.5):.2g} {seen.unit(j)}'
    what = f'a resonance at {rung:.1f} Hz (an elastic gear?)' if rung else 'the model or the log'
    return f'{joint}: moves as no motor, weight or friction makes it, by {size}: {what}'


def _all_of(seen: Flow, kind: str, why: str) -> list[Finding]:
    times = [seen.time[seen.episode == n] for n in np.unique(seen.episode)]
    half = 0.5 * seen.bell
    return [stretch(kind, why, float(t[0]) - half, float(t[-1]) + half) for t in times]
