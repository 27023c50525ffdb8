# SPDX-License-Identifier: Apache-2.0
"""Findings on shoves, hands and stops: what moved the robot that is not the robot."""

from __future__ import annotations

from itertools import groupby

from leo_diffmodel.bags.recording import Recording
from leo_diffmodel.check.finding import ERROR, Finding, OK, times, WARNING
from leo_diffmodel.outside.outside import LEFT_OUT, moved_from_outside, Stretch
from leo_sim.model import Model

TODO = {
    'push': 'a hand, a stop or a cable? cut it out: leo bag cut --without-outside',
    'hand': 'a hand is in no model: record again with nothing but the motors moving it',
    'blocked': 'free the joint and record again, or cut it out: leo bag cut --without-outside',
    'held': 'nothing: leo explain leaves it out',
}


def forces(recording: Recording, model: Model) -> list[Finding]:
    """One finding for each joint and kind of force from outside."""
    if model.robot.contacts and not recording.held:
        return []
    found = [s for s in moved_from_outside([recording], model) if s.kind in LEFT_OUT]
    groups = groupby(sorted(found, key=_kind), _kind)
    told = [_finding(kind, list(stretches)) for (kind, _), stretches in groups]
    return told or [Finding('push', OK, 'no hand push, no collision')]


def _kind(stretch: Stretch) -> tuple[str, str]:
    return stretch.kind, stretch.why.split(':')[0]


def _finding(kind: str, found: list[Stretch]) -> Finding:
    where = tuple((s.begin, s.end) for s in found)
    severity = ERROR if kind == 'hand' else WARNING
    return Finding(kind, severity, f'{found[0].why}: {times(where)}', where, TODO[kind])
