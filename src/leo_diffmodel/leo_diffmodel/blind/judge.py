# SPDX-License-Identifier: Apache-2.0
"""Judge an explanation against the truth of its case, once the verdict is in."""

from __future__ import annotations

from leo_diffmodel.blind.case import Case
from leo_diffmodel.explain.classes import CLASSES, Facts
from leo_diffmodel.explain.scored import MARGIN_NATS

LARGEST_SET = 3


def judge(case: Case, answer: dict) -> dict:
    """One line of the results file.

    `right` means: no effect, and fine; or the true effect and place named first, alone or with
    what is the same thing in the data; or an ambiguous set of at most three things that holds
    it, where a class of the same thing is one.
    """
    first = answer['effects'][0] if answer['effects'] else None
    truth = None if case.effect is None else (case.effect.effect.name, case.effect.where[0])
    return {
        'seed': case.seed,
        'robot': case.robot.name,
        'engine': case.engine[0],
        'noise': list(case.noise),
        'truth': truth[0] if truth else None,
        'where': truth[1] if truth else None,
        'parameters': {} if case.effect is None else dict(case.effect.parameters),
        'size': case.size,
        'verdict': answer['verdict'],
        'named': first['name'] if first else None,
        'found': first['parameters'] if first else {},
        'also': [e['name'] for e in answer['effects'][1:]],
        'set': sorted(_set(first)) if first else [],
        'gain': first['gain_train'] + first['gain_held_out'] if first else 0.0,
        'chi2_ratio': answer['errors'].get('chi2_ratio'),
        'seconds': answer['seconds'],
        'right': _right(case, truth, answer, first),
    }


def _right(
    case: Case, truth: tuple[str, str] | None, answer: dict, first: dict | None
) -> bool:
    if truth is None:
        return answer['verdict'] == 'fine'
    if first is None:
        return False
    if answer['verdict'] == 'ambiguous':
        rivals = _set(first)
        return truth[0] in rivals and _distinct(rivals, case) <= LARGEST_SET
    together = {first['name'], *(r['name'] for r in _same(first))}
    return answer['verdict'] == 'named' and truth[0] in together


def _distinct(names: set[str], case: Case) -> int:
    """How many different things a set names: two that are equal whatever their size are one."""
    facts = Facts(case.robot, ever_free=False)
    classes = [c.names for c in CLASSES if c.holds(facts) and len(c.names) == 2]
    things = {next((c for c in classes if name in c), frozenset({name})) for name in names}
    return len(things)


def _same(first: dict) -> list[dict]:
    return [r for r in first['confusable_with'] if r['same_thing']]


def _set(first: dict) -> set[str]:
    """The effects that the answer leaves open, the first one included."""
    near = [r for r in first['confusable_with'] if r['separable_nats'] < MARGIN_NATS]
    return {first['name'], *(r['name'] for r in near)}
