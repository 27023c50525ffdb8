# SPDX-License-Identifier: Apache-2.0
"""Check recordings: what is wrong with them, and which effects they could show."""

from collections.abc import Callable, Sequence
from dataclasses import asdict, dataclass, replace
from itertools import groupby

import numpy as np

from leo_diffmodel.bags.recording import Recording, Recordings
from leo_diffmodel.check.amplitudes import Reach, reaches
from leo_diffmodel.check.angles import angle_units, positions_only
from leo_diffmodel.check.excitation import Excitation, excitation, judge, noise_level
from leo_diffmodel.check.goals import asked, frame_shift
from leo_diffmodel.check.hold import hold
from leo_diffmodel.check.pairs import alike, hidden, nowhere, Pair
from leo_diffmodel.check.timing import even_stamps, length, slow, timing
from leo_diffmodel.check.traces import traces_of
from leo_diffmodel.compare import errors, noise
from leo_diffmodel.compare.known import provenance, with_known
from leo_diffmodel.compare.pushes import fast_enough
from leo_diffmodel.compare.windows import Array, cut
from leo_diffmodel.explain.problem.classes import Facts
from leo_diffmodel.faults.find import faults_of
from leo_diffmodel.faults.found import Found
from leo_diffmodel.faults.mending import mapped
from leo_diffmodel.outside.finding import ERROR, Finding, OK, times, WARNING
from leo_diffmodel.outside.outside import moved_from_outside
from leo_msgs_py.console import listed
from leo_sim.description.robot import Robot
from leo_sim.effects import Effect
from leo_sim.model import Model


@dataclass(frozen=True)
class Bag:
    recording: Recording  # as read
    other: Recording | None = None
    """Read with the inputs held the other way; None leaves that question out."""
    hold: str = 'next'  # how `recording` was read, 'next' or 'previous'


@dataclass(frozen=True)
class Check:
    findings: tuple[Finding, ...]  # of every check, per bag, errors first
    excitation: tuple[Excitation, ...]  # what each joint was put through
    reaches: tuple[Reach, ...]  # what can be said about each effect
    pairs: tuple[Pair, ...]  # effects that look alike in this data
    threshold: float | None
    """Gain that noise alone can give [nats]; None where nothing could be scanned."""
    seconds: float  # how much data there is
    provenance: dict  # bags, hashes, model, versions

    @property
    def is_good(self) -> bool:
        """Whether nothing is wrong, and half of the effects or more could be found and named."""
        wrong = any(f.severity == ERROR for f in self.findings)
        return not wrong and len(self.reaches) <= 2 * self._able > 0

    @property
    def _able(self) -> int:
        return sum(r.detectable is not None and bool(r.nameable) for r in self.reaches)

    @property
    def answer(self) -> str:
        """Whether these recordings are good enough, or for what not."""
        severities = [f.severity for f in self.findings]
        blind = [r.label for r in self.reaches if r.detectable is None]
        twins = [r.label for r in self.reaches if r.detectable is not None and not r.nameable]
        able, every = self._able, len(self.reaches)
        if ERROR in severities or not able:
            marked = ERROR if ERROR in severities else WARNING
            return f'no: mend first what is marked {marked}'
        limits = [f'not to {to}: {listed(x)}' for to, x in (('find', blind), ('name', twins)) if x]
        if limits:
            said = 'yes,' if self.is_good else 'no, only'
            return '; '.join([f'{said} for {able} of {every} effects', *limits])
        said = f'each of {every} effects could be found and named'
        return f'{"yes, with warnings" if WARNING in severities else "yes"}: {said}'

    def to_json(self) -> dict:
        return {
            'good': self.is_good,
            'answer': self.answer,
            'findings': [asdict(f) for f in self.findings],
            'excitation': [asdict(e) for e in self.excitation],
            'effects': [asdict(r) for r in self.reaches],
            'pairs': [asdict(p) for p in self.pairs],
            'threshold_nats': self.threshold,
            'seconds': self.seconds,
            'provenance': self.provenance,
        }


def check(
    bags: Sequence[Bag],
    model: Model,
    extra: Sequence[Effect] = (),
    progress: Callable[[str], None] = lambda _: None,
) -> Check:
    """Look at the bags of one robot one by one, then at what they can show together.

    `extra` are a user's own effects; `progress` is called with what is being looked at.
    """
    recordings = [bag.recording for bag in bags]
    model = with_known(model, recordings)
    try:
        model = fast_enough(model, cut(recordings, errors.step_seconds(recordings)))
        sigma = noise.estimate(model, noise.short_windows(recordings))
    except ValueError as error:
        return _too_short(bags, model, str(error))
    looked = [look_at(bag, model, s) for bag, s in zip(bags, sigma, strict=True)]
    findings = [f for found, _ in looked for f in found]
    recordings = [right for _, right in looked]
    if any(right is not bag.recording for right, bag in zip(recordings, bags, strict=True)):
        sigma = noise.estimate(model, noise.short_windows(recordings))
    progress('timing and sensors')
    ranges = excitation(recordings, sigma, model.robot)
    findings += [length(recordings), *of_all(recordings, model, sigma, ranges)]
    try:
        data = traces_of(recordings, model, extra, progress, sigma)
    except ValueError as error:
        return _too_short(bags, model, str(error))
    rows, apart = reaches(data, Facts.of(model.robot, recordings))
    pairs = alike(rows, apart, data.seconds)
    rows = [r for r in rows if r.detectable is not None or r.label not in nowhere(model)]
    findings += [hidden(rows, data.seconds, recordings, model)]
    found, origin = (tuple(ranges), tuple(rows), tuple(pairs)), provenance(recordings, model)
    return Check(_sorted(findings), *found, data.threshold, data.seconds, origin)


def look_at(bag: Bag, model: Model, sigma: Array) -> tuple[list[Finding], Recording]:
    """What is wrong, or right, with a bag of noise sigma (2J,), and the bag put right."""
    faults = faults_of(bag.recording, model)
    sure = [f for f in faults if f.error and f.code != 'input_late']  # `hold` tells it
    recording, other = bag.recording, bag.other and mapped(bag.other, sure)
    held = hold(mapped(recording, sure), other, bag.hold, model, sigma)
    if bag.other is not None and any(f.severity == ERROR for f in held):
        recording, faults = bag.other, faults_of(bag.other, model)
    right = mapped(recording, [f for f in faults if f.error])
    found = [
        *timing(recording),
        *held,
        *of_faults(recording, faults),
        *traps(recording, model.robot),
        *forces(right, model),
    ]
    return [replace(f, bag=str(recording.path)) for f in found], right


def traps(recording: Recording, robot: Robot) -> list[Finding]:
    """What logs made for something else than identification hide: teleoperation above all."""
    with np.errstate(all='ignore'):  # whatever numbers a log holds
        return [
            *angle_units(recording, robot),
            *even_stamps(recording),
            *slow(recording),
            *positions_only(recording, robot),
            *asked(recording),
            *frame_shift(recording),
        ]


def of_all(
    recordings: Recordings, model: Model, sigma: Array, ranges: Sequence[Excitation]
) -> list[Finding]:
    """How noisy the joints are, and how much they move, in all bags together."""
    robot = model.robot
    return [*noise_level(recordings, sigma, robot), *judge(ranges, robot.base_joints)]


def _sorted(findings: Sequence[Finding]) -> tuple[Finding, ...]:
    return tuple(sorted(findings, key=lambda f: (ERROR, WARNING, OK).index(f.severity)))


def _too_short(bags: Sequence[Bag], model: Model, why: str) -> Check:
    recordings = [bag.recording for bag in bags]
    seconds = sum(e.seconds for r in recordings for e in r.episodes)
    todo = 'record 20 s or more with a changing input, or leave that bag out'
    short = Finding('short', ERROR, why, todo)
    told = ((r, f) for r in recordings for f in (*timing(r), *traps(r, model.robot)))
    found = [replace(f, bag=str(r.path)) for r, f in told]
    findings, origin = [short, length(recordings), *found], provenance(recordings, model)
    return Check(_sorted(findings), (), (), (), None, seconds, origin)


def of_faults(recording: Recording, faults: Sequence[Found]) -> list[Finding]:
    """One finding for each fault, and one for each joint whose speed is that of its angle."""
    found = [_finding(f) for f in faults]
    if recording.rates != 'measured':
        return found
    wrong = {f.joint for f in faults if f.evidence == 'kinematics'}
    right = (joint for joint in recording.joints if not wrong & {joint, ''})
    said = 'the speed is the derivative of the position'
    return found + [Finding('rate', OK, f'{joint}: {said}') for joint in right]


def _finding(f: Found) -> Finding:
    where = f': {times(f.where)}' if f.where else ''
    mend = f'put "{f.line}" into the topic map (--topic-map MAP.yaml)' if f.line else ''
    todo = mend if f.error and mend else f.fault.todo or mend
    return Finding(f.code, f.severity, f.in_words + where, todo, f.where)


def forces(recording: Recording, model: Model) -> list[Finding]:
    if model.robot.contacts and not recording.held:
        return []
    groups = groupby(sorted(moved_from_outside(recording, model), key=_kind), _kind)
    out = [_together(list(stretches)) for _, stretches in groups]
    return out or [Finding('push', OK, 'no hand push, no collision')]


def _kind(stretch: Finding) -> tuple[str, str]:
    return stretch.code, stretch.what.split(':')[0]


def _together(stretches: Sequence[Finding]) -> Finding:
    first, where = stretches[0], tuple(span for f in stretches for span in f.where)
    return replace(first, what=f'{first.what}: {times(where)}', where=where)
