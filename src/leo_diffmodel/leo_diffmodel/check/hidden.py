# SPDX-License-Identifier: Apache-2.0
"""Which effects could hide in the data, however large."""

from __future__ import annotations

from collections.abc import Sequence

from leo_diffmodel.bags.recording import Recording
from leo_diffmodel.check.amplitudes import Reach
from leo_diffmodel.check.finding import Finding, OK, WARNING
from leo_diffmodel.explain.problem.candidates import uncertain
from leo_sim.model import Model


def hidden(
    rows: Sequence[Reach], seconds: float, recordings: Sequence[Recording], model: Model
) -> Finding:
    """Effects that would not show, or not be named, and what to do about it."""
    blind = [r.label for r in rows if r.detectable is None and r.label not in nowhere(model)]
    twins = [r.label for r in rows if r.detectable is not None and r.nameable is None]
    if blind:
        what = f'effects that would not show, however large: {", ".join(blind)}'
        return Finding('untestable', WARNING, what, (), _instead(recordings, model))
    if twins:
        what = f'effects that would show but could not be named: {", ".join(twins)}'
        return Finding('twins', WARNING, what, (), 'leo next proposes a run that parts them')
    what = f'{len(rows)} effects can be found and named in these {seconds:.0f} s (table)'
    return Finding('effects', OK, what)


def _instead(recordings: Sequence[Recording], model: Model) -> str:
    if model.robot.base_joints and all(r.held for r in recordings):
        return 'the base was held: record the robot standing and stepping too'
    names = [r.name for r in recordings]
    refitted = list(dict.fromkeys(c.path for c in uncertain(model, names)))
    todo = 'leo next proposes a run that shows them'
    return (
        f'{todo}; or the refitted constants take their place: {", ".join(refitted)}'
        if refitted
        else todo
    )


def nowhere(model: Model) -> tuple[str, ...]:
    """What no data can show: where along the floor a robot is makes no difference to it."""
    return tuple(f'encoder_offset:{joint}' for joint in model.robot.base_joints[:1])
