# SPDX-License-Identifier: Apache-2.0
"""The sentence a person reads first."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

import numpy as np

from leo_diffmodel.explain.decide.verdict import Decision, Named
from leo_diffmodel.explain.findings.findings import Findings, Shown


def answer(findings: Findings, decision: Decision, left_out: Sequence[str] = ()) -> str:
    """The decision in words; `left_out` says what of the recordings was not used."""
    notes = [*decision.doubts, *left_out, *decision.notes]
    words = findings.unknown.words if findings.unknown else None
    told = sentence(
        decision.verdict,
        decision.named,
        _change(findings),
        notes,
        words,
        _left(findings),
        not findings.search.complete,
    )
    return ' '.join([told, *shown(findings)])


def sentence(
    verdict: str,
    named: Sequence[Named],
    change: str,
    notes: Sequence[str] = (),
    outside: str | None = None,
    rest: str = '',
    cut_short: bool = False,
) -> str:
    """One or two plain sentences.

    Args:
        verdict: of `decide`.
        named: the supported effects.
        change: how the held-out error changed, in words.
        notes: doubts, and what the named effects could also be, in words.
        outside: the law that is no known effect, or who moved the robot, in words.
        rest: how much is left and where, in words.
        cut_short: not all was tried.
    """
    if notes:
        change = f'{change} ({"; ".join(notes)})'
    listed = '; '.join(_describe(n) for n in named)
    if cut_short:
        return f'Cut short, so nothing is sure: {"; ".join(filter(None, [listed, change]))}.'
    if verdict == 'fine':
        return f'Nothing is missing that this data can show: {change}.'
    if verdict == 'unknown':
        return _unknown(listed, change, outside)
    if verdict == 'ambiguous':
        return f'Something is missing that this data cannot pin down: {listed}; {change}.'
    if verdict == 'partly':
        return f'Missing for sure: {listed}; {change}. {rest}.'
    return f'Missing: {listed}; {change}.'


def _unknown(listed: str, change: str, outside: str | None) -> str:
    rest = f': {outside}' if outside else ''
    if not listed and outside:
        return f'Something is missing, and none of the known effects is it{rest}.'
    if not listed:
        return f'Something is missing, and none of the known effects is it: {change}.'
    return f'Part of what is missing is {listed}: {change}. The rest is no known effect{rest}.'


def _describe(named: Named) -> str:
    text = f'{named.label} ({named.text})'
    if named.together:
        text += f', which is the same thing in this data as {_either(named.together)}'
    if named.rivals:
        text += f', or {_either(named.rivals)}'
    if named.doubt:
        text += f', {named.doubt}'
    return text


def _either(labels: Sequence[str]) -> str:
    return ' or '.join(labels)


def _change(findings: Findings) -> str:
    """How the held-out error of each state changed, in words.

    Where there are many, of those furthest off against their noise.
    """
    told, kind = findings.headline, findings.headline.statistic
    (_, before), (_, after) = findings.ladder[0], findings.ladder[-1]
    states = findings.errors['states']
    figures = before[kind], after[kind], findings.floor[kind]
    listed = list(zip(states, *figures, strict=True))
    first = sorted(listed, key=lambda row: -max(row[1:3]) / max(row[3], 1e-12))
    numerics = findings.numerics
    first = listed if len(listed) <= numerics.states_listed else first[: numerics.listed]
    parts = [f'{s["name"]} {b:.2g} -> {a:.2g} {s["unit"]} (noise {f:.2g})' for s, b, a, f in first]
    rest = f' and {len(listed) - len(first)} more states' if len(first) < len(listed) else ''
    return f'{told.words}: ' + ', '.join(parts) + rest


def shown(findings: Findings) -> Iterator[str]:
    """In how many recordings, and where the joints were there; nothing where none is named."""
    told, count = findings.shown[: findings.numerics.listed], len(findings.bags)
    more = len(findings.shown) - len(told)
    if told:
        seen = 'one recording' if count == 1 else f'{count} recordings'
        rest = f', and {more} more joints' if more else ''
        yield f'Shown in {seen}, with {"; ".join(map(_range, told))}{rest}.'


def _range(seen: Shown) -> str:
    a, v, load = seen.angle, seen.speed, seen.load
    return (
        f'{seen.joint} at {a.low:.2g} to {a.high:.2g} {a.unit}, {v.low:.2g} to {v.high:.2g} '
        f'{v.unit} and {load.low:.2g} to {load.high:.2g} {load.unit}'
    )


def _left(findings: Findings) -> str:
    """How much is left, and where most of it is, in words."""
    names, train = findings.base.robot.joint_names, findings.search.problem.train
    e = findings.final.residual[train].reshape(int(train.sum()), -1, 2, len(names))
    worst = names[int(np.argmax(np.median((e**2).mean(axis=(1, 2)), axis=0)))]
    left = findings.rest.share
    share = f'{100 * left:.0f} % of the mean squared error beyond noise is something else'
    return share if len(names) == 1 else f'{share}, most of it at {worst}'
