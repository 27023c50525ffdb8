# SPDX-License-Identifier: Apache-2.0
"""Which effects are alike in this data, and which do not show in it."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from leo_diffmodel.bags.recording import Recordings
from leo_diffmodel.check.amplitudes import Apart, Reach
from leo_diffmodel.check.settings import CHECK
from leo_diffmodel.explain.problem.candidates import uncertain
from leo_diffmodel.explain.settings import SETTINGS
from leo_diffmodel.outside.finding import Finding, OK, WARNING
from leo_sim.model import Model


@dataclass(frozen=True)
class Pair:
    a: str  # labels, effect:where
    b: str
    separable_nats: float
    """By which either beats the other where it is the truth, at a typical size."""
    seconds: float | None
    """Data like these that separating them needs [s]; None where none would do."""
    same_thing: bool  # they are equal in any data of this kind


def alike(rows: Sequence[Reach], apart: Apart, seconds: float) -> list[Pair]:
    """The pairs that stay within the margin for a name, closest first, in data so long [s].

    Effects that would not even show at their typical size are left out.
    """
    shown = np.array([(r.seconds_to_detect or np.inf) <= seconds for r in rows])
    near = np.minimum(apart.separable, apart.separable.T) < SETTINGS.gates.margin_nats
    close = apart.same | (near & shown & shown[:, None])
    found = []
    for i, j in np.argwhere(np.triu(close, 1)):
        same, nats = bool(apart.same[i, j]), min(apart.separable[i, j], apart.separable[j, i])
        times = max(apart.longer[i, j], apart.longer[j, i])
        wanted = None if same or times > CHECK.most_times else float(seconds * times)
        found.append(Pair(rows[i].label, rows[j].label, float(nats), wanted, same))
    return sorted(found, key=lambda p: (not p.same_thing, p.separable_nats))


def groups(pairs: Sequence[Pair]) -> list[list[str]]:
    """The effects that are the same thing, class by class."""
    found: list[set[str]] = []
    for pair in (p for p in pairs if p.same_thing):
        touched = [g for g in found if g & {pair.a, pair.b}]
        found = [g for g in found if g not in touched] + [{pair.a, pair.b}.union(*touched)]
    return [sorted(g) for g in found]


def hidden(rows: Sequence[Reach], seconds: float, recordings: Recordings, model: Model) -> Finding:
    """Effects that would not show, or not be named, and what to do about it."""
    blind = [r.label for r in rows if r.detectable is None and r.label not in nowhere(model)]
    twins = [r.label for r in rows if r.detectable is not None and r.nameable is None]
    if blind:
        what = f'effects that would not show, however large: {", ".join(blind)}'
        return Finding('untestable', WARNING, what, _instead(recordings, model))
    if twins:
        what = f'effects that would show but could not be named: {", ".join(twins)}'
        return Finding('twins', WARNING, what, 'leo next proposes a run that parts them')
    what = f'{len(rows)} effects can be found and named in these {seconds:.0f} s (table)'
    return Finding('effects', OK, what)


def _instead(recordings: Recordings, model: Model) -> str:
    if model.robot.base_joints and all(r.held for r in recordings):
        return 'the base was held: record the robot standing and stepping too'
    names = [r.name for r in recordings]
    refitted = ', '.join(dict.fromkeys(c.path for c in uncertain(model, names)))
    more = f'; or the refitted constants take their place: {refitted}' if refitted else ''
    return f'leo next proposes a run that shows them{more}'


def nowhere(model: Model) -> tuple[str, ...]:
    """Effects that no data need show.

    Where along the floor a robot is changes nothing; one that takes no volts has no limit of them.
    """
    robot = model.robot
    driven = () if robot.has_motor_law else (*(a.joint for a in robot.actuators), 'all')
    limits = (f'voltage_limit:{place}' for place in driven)
    return (*(f'encoder_offset:{joint}' for joint in robot.base_joints[:1]), *limits)
