# SPDX-License-Identifier: Apache-2.0
"""The sentence a person reads first, and what to record next."""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from leo_diffmodel.explain.decide import Decision, Named
from leo_diffmodel.explain.findings.findings import Findings, Shown
from leo_diffmodel.explain.told import Thing, Told

ABOUT = {
    'fine': 'Nothing is missing that this data can show',
    'named': 'Missing',
    'partly': 'Missing for sure',
    'ambiguous': 'Something is missing that this data cannot pin down',
    'unknown': 'Something is missing, and none of the known effects is it',
}
PART = 'Part of what is missing'
CUT_SHORT = 'Cut short, so nothing is sure'
NEXT = (
    'leo next with the same bags and model simulates a menu of safe runs with every answer that '
    'is still open, picks the one that tells them apart best, and writes it for leo play'
)
MORE_TIME = 'the same again without --within, or with more time'
REPEAT = 'repeat the run, then vary one thing at a time: speed, load, angle, supply'
MEASURED = 'if the torque was measured, say how noisy it is (sensors, input_noise in robot.yaml)'
BY_HAND = 'swing it by hand from other angles'


def answer(findings: Findings, decision: Decision, notes: Sequence[str] = ()) -> Told:
    """The decision in words; `notes` say what was done to recordings and model before."""
    all_notes = [*decision.doubts, *notes, *decision.notes]
    law, late = findings.unknown.words if findings.unknown else '', not findings.search.complete
    change, rest, seen = _change(findings), _left(findings), shown(findings)
    said = told(decision.verdict, decision.named, change, all_notes, law, rest, late)
    return replace(said, more=(*said.more, seen)) if seen else said


def told(
    verdict: str,
    named: Sequence[Named],
    change: str,
    notes: Sequence[str] = (),
    unknown: str = '',
    rest: str = '',
    cut_short: bool = False,
) -> Told:
    """What a verdict says.

    `change` of the held-out error, the `unknown` law and the `rest` that is left are in words.
    """
    sure = tuple(n for n in named if n.sure or verdict != 'partly')
    said = Told(ABOUT[verdict], tuple(map(_describe, sure)), change, tuple(notes))
    if cut_short:
        return replace(said, about=CUT_SHORT)
    if not named:
        return replace(said, change=unknown or change)
    law = f'The rest is no known effect: {unknown}'.removesuffix(': ')
    unsure = '; '.join(str(_describe(n)) for n in named if n not in sure)
    open_ = f'Beside them, not sure: {unsure}' if unsure else ''
    left = [open_, rest, law if unknown or verdict == 'unknown' else '']
    about = PART if verdict == 'unknown' else said.about
    return replace(said, about=about, more=tuple(f'{words}.' for words in left if words))


def _describe(named: Named) -> Thing:
    text = f'({named.text})'
    if named.together:
        text += f', which is the same thing in this data as {" or ".join(named.together)}'
    if named.rivals:
        text += f', or {" or ".join(named.rivals)}'
    if named.doubt:
        text += f', {named.doubt}'
    return Thing(named.label, text)


def _change(findings: Findings) -> str:
    """How the held-out error of each state changed.

    Where there are many, of those furthest off against their noise.
    """
    headline, numerics = findings.headline, findings.numerics
    (_, before), (_, after) = findings.ladder[0], findings.ladder[-1]
    figures = (f[headline.statistic] for f in (before, after, findings.floor))
    first = listed = list(zip(findings.errors['states'], *figures, strict=True))
    if len(listed) > numerics.states_listed:
        first = sorted(listed, key=lambda row: -max(row[1:3]) / max(row[3], 1e-12))
        first = first[: numerics.listed]
    parts = [f'{s["name"]} {b:.2g} -> {a:.2g} {s["unit"]} (noise {f:.2g})' for s, b, a, f in first]
    rest = f' and {len(listed) - len(first)} more states' if len(first) < len(listed) else ''
    return f'{headline.words}: ' + ', '.join(parts) + rest


def shown(findings: Findings) -> str:
    """In how many recordings, and where the joints were there; '' where nothing is named."""
    first, count = findings.shown[: findings.numerics.listed], len(findings.bags)
    if not first:
        return ''
    more = len(findings.shown) - len(first)
    seen = 'one recording' if count == 1 else f'{count} recordings'
    rest = f', and {more} more joints' if more else ''
    return f'Shown in {seen}, with {"; ".join(map(_ranges, first))}{rest}.'


def _ranges(of: Shown) -> str:
    where, push = ('positions', 'forces') if of.angle.unit == 'm' else ('angles', 'torques')
    return f'{of.joint} at {where} {of.angle}, speeds {of.speed}, {push} in the gear {of.load}'


def _left(findings: Findings) -> str:
    """How much is left, and where most of it is; '' where that does not matter."""
    if not findings.rest.matters:
        return ''
    names, train = findings.base.robot.joint_names, findings.search.problem.train
    e = findings.final.residual[train].reshape(int(train.sum()), -1, 2, len(names))
    worst = names[int(np.argmax(np.median((e**2).mean(axis=(1, 2)), axis=0)))]
    left = findings.rest.share
    share = f'{100 * left:.0f} % of the mean squared error beyond noise is something else'
    return share if len(names) == 1 else f'{share}, most of it at {worst}'


def next_run(decided: Decision, findings: Findings) -> str | None:
    """What would settle an open answer, in the words of the effects concerned."""
    if not findings.search.complete:
        return MORE_TIME
    if decided.verdict == 'ambiguous' or decided.beside:
        margin = findings.gates.margin_nats
        close = [r.candidate.effect.reveal for p in findings.effects for r in p.close(margin)]
        driven = any(a.strongest > 0 for a in findings.base.robot.actuators)
        return '; '.join([*dict.fromkeys(close), NEXT if driven else BY_HAND])
    if findings.unknown:
        return f'repeat the run, and {findings.unknown.reveal}'
    if decided.verdict in ('unknown', 'partly'):
        robot = findings.base.robot
        exact = robot.input == 'torque' and not robot.input_noise.any()
        return f'{REPEAT}; {MEASURED}' if exact else REPEAT
    return None
