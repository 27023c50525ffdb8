# SPDX-License-Identifier: Apache-2.0
"""Faults of a log as findings of a check, and which joints agree with themselves."""

from __future__ import annotations

from collections.abc import Sequence

from leo_diffmodel.bags.recording import Recording
from leo_diffmodel.check.finding import ERROR, Finding, OK, times, WARNING
from leo_diffmodel.faults.base import Found


def of_faults(recording: Recording, faults: Sequence[Found]) -> list[Finding]:
    """One finding for each fault, and one for each joint whose speed is that of its angle."""
    found = [_finding(f) for f in faults]
    if recording.rates != 'measured':
        return found
    wrong = {f.joint for f in faults if f.evidence == 'kinematics'}
    good = [
        Finding('rate', OK, f'{joint}: the speed is the derivative of the angle')
        for joint in recording.joints
        if joint not in wrong and '' not in wrong
    ]
    return found + good


def _finding(f: Found) -> Finding:
    told = '; or '.join([f.what, *f.otherwise])
    where = f': {times(f.where)}' if f.where else ''
    mend = f'put "{f.line}" into the topic map (--topic-map MAP.yaml)' if f.line else ''
    todo = mend if f.error and mend else f.fault.todo(f.value) or mend
    return Finding(f.fault.name, ERROR if f.error else WARNING, told + where, f.where, todo)
