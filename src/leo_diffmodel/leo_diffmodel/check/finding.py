# SPDX-License-Identifier: Apache-2.0
"""Faults of the log, and what moved the robot from outside, as findings of a check."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from itertools import groupby

from leo_diffmodel.bags.recording import Recording
from leo_diffmodel.check.settings import CHECK
from leo_diffmodel.faults.found import Found
from leo_diffmodel.outside.finding import Finding, OK
from leo_diffmodel.outside.outside import moved_from_outside
from leo_sim.model import Model


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
    where = f': {times(f.where)}' if f.where else ''
    mend = f'put "{f.line}" into the topic map (--topic-map MAP.yaml)' if f.line else ''
    todo = mend if f.error and mend else f.fault.todo or mend
    return Finding(f.code, f.severity, f.in_words + where, todo, f.where)


def forces(recording: Recording, model: Model) -> list[Finding]:
    """One finding for each joint and kind of force from outside."""
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
