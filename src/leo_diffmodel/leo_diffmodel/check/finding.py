# SPDX-License-Identifier: Apache-2.0
"""A finding of a check; those of faults of the log, and of what moved the robot from outside."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import groupby

from leo_diffmodel.bags.recording import Recording
from leo_diffmodel.check.settings import CHECK
from leo_diffmodel.faults.base import Found
from leo_diffmodel.outside.outside import moved_from_outside, Stretch
from leo_sim.model import Model

OK, WARNING, ERROR = 'ok', 'warning', 'error'
TODO = {
    'push': 'a hand, a stop or a cable? cut it out: leo bag cut --without-outside',
    'hand': 'a hand is in no model: record again with nothing but the motors moving it',
    'blocked': 'free the joint and record again, or cut it out: leo bag cut --without-outside',
    'unexplained': 'are columns, units and signs of the inputs right? leo explain asks effects',
    'held': 'nothing: leo explain leaves it out',
}


@dataclass(frozen=True)
class Finding:
    """What one check found."""

    code: str  # stable name of the finding, for programs
    severity: str
    """Ok; warning, which limits what can be learned; or error, which makes what is learned
    wrong."""
    what: str  # a sentence
    todo: str = ''  # what to do about it; empty where nothing is to be done
    where: tuple[tuple[float, float], ...] = ()
    """Stretches of the bag [s since its first state], empty for all of it."""
    bag: str = ''


def times(stretches: Sequence[tuple[float, float]]) -> str:
    """The first few stretches in words."""
    first = ', '.join(f'{begin:.2f}-{end:.2f} s' for begin, end in stretches[: CHECK.times_shown])
    more = len(stretches) - CHECK.times_shown
    return f'{first} and {more} more' if more > 0 else first


def of_faults(recording: Recording, faults: Sequence[Found]) -> list[Finding]:
    """One finding for each fault, and one for each joint whose speed is that of its angle."""
    found = [_finding(f) for f in faults]
    if recording.rates != 'measured':
        return found
    wrong = {f.joint for f in faults if f.evidence == 'kinematics'}
    good = [
        Finding('rate', OK, f'{joint}: the speed is the derivative of the position')
        for joint in recording.joints
        if joint not in wrong and '' not in wrong
    ]
    return found + good


def _finding(f: Found) -> Finding:
    what = '; or '.join([f.what, *f.otherwise])
    where = f': {times(f.where)}' if f.where else ''
    mend = f'put "{f.line}" into the topic map (--topic-map MAP.yaml)' if f.line else ''
    todo = mend if f.error and mend else f.fault.todo or mend
    return Finding(f.fault.name, ERROR if f.error else WARNING, what + where, todo, f.where)


def forces(recording: Recording, model: Model) -> list[Finding]:
    """One finding for each joint and kind of force from outside."""
    if model.robot.contacts and not recording.held:
        return []
    found = sorted(moved_from_outside([recording], model), key=_kind)
    groups = groupby(found, _kind)
    out = [_of_force(kind, list(stretches)) for (kind, _), stretches in groups]
    return out or [Finding('push', OK, 'no hand push, no collision')]


def _kind(stretch: Stretch) -> tuple[str, str]:
    return stretch.kind, stretch.why.split(':')[0]


def _of_force(kind: str, found: list[Stretch]) -> Finding:
    where = tuple((s.begin, s.end) for s in found)
    severity = ERROR if kind == 'hand' else WARNING
    return Finding(kind, severity, f'{found[0].why}: {times(where)}', TODO[kind], where)
