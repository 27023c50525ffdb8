# SPDX-License-Identifier: Apache-2.0
"""What to record next."""

from __future__ import annotations

from leo_diffmodel.explain.findings.findings import Findings

NEXT = (
    'leo next with the same bags and model simulates a menu of safe runs with every answer that '
    'is still open, picks the one that tells them apart best, and writes it for leo play'
)
MORE_TIME = 'the same again without --within, or with more time'
BY_HAND = 'swing it by hand from other angles'


def next_run(verdict: str, findings: Findings) -> str | None:
    """What would settle an open answer, in the words of the effects concerned."""
    if not findings.search.complete:
        return MORE_TIME
    if verdict == 'ambiguous':
        margin = findings.gates.margin_nats
        close = [
            r.candidate.effect.reveal
            for part in findings.effects
            for r in part.rivals
            if not r.same and r.behind < margin
        ]
        driven = any(a.strongest > 0 for a in findings.base.robot.actuators)
        return '; '.join([*dict.fromkeys(close), NEXT if driven else BY_HAND])
    if findings.unknown:
        return f'repeat the run, and {findings.unknown.reveal}'
    if verdict in ('unknown', 'partly'):
        return 'repeat the run, then vary one thing at a time: speed, load, angle, supply'
    return None
