# SPDX-License-Identifier: Apache-2.0
"""Judge an explanation against the truth of its case, once the verdict is in."""

from __future__ import annotations

from collections.abc import Iterable
from itertools import permutations

from leo_diffmodel.blind import outside
from leo_diffmodel.blind.parameters import parameter_errors
from leo_diffmodel.explain.classes import Facts, why_same
from leo_diffmodel.explain.scored import MARGIN_NATS
from leo_sim.effects import EFFECTS
from leo_sim.robot import Robot

LARGEST_SET = 3
SURE = 0.9
NEVER_FAR = ('hysteresis', 'winding_drift')
"""Laws whose nearest relatives in the catalogue may be named, as long as it stays open."""
Thing = tuple[str, str]


def judge(truth: dict, answer: dict, robot: Robot) -> dict:
    """One line of the results file.

    Args:
        truth: of a case, see `truth.reveal`.
        answer: the contents of explain.json.
        robot: of the case, as everybody knows it.
    """
    named = [_thing(e) for e in answer['effects']]
    return {
        **truth,
        'verdict': answer['verdict'],
        'named': [list(thing) for thing in named],
        'set': [sorted(map(list, _open(e))) for e in answer['effects']],
        'gain': [e['gain_train'] + e['gain_held_out'] for e in answer['effects']],
        'found': [e['parameters'] for e in answer['effects']],
        'inclusion': [e['inclusion_probability'] for e in answer['effects']],
        'chi2_ratio': answer['errors'].get('chi2_ratio'),
        'seconds': answer['seconds'],
        'errors': _errors(truth, answer['effects']),
        **_JUDGES[truth['kind']](truth, answer, Facts(robot, truth['ever_free'])),
    }


def _nothing(truth: dict, answer: dict, facts: Facts) -> dict:
    return {'right': answer['verdict'] == 'fine'}


def _single(truth: dict, answer: dict, facts: Facts) -> dict:
    """Right: the effect and its place first, alone or with what is the same in the data.

    An ambiguous set of at most three things that holds it is right as well, where a class of
    the same thing is one.
    """
    hidden, rows = truth['effects'][0], answer['effects']
    first = rows[0] if rows else None
    if first is None or answer['verdict'] not in ('named', 'ambiguous'):
        return {'right': False, 'family': False}
    return {
        'right': _found(facts, hidden, first),
        'family': _found(facts, hidden, first) or _family(first['name']) == hidden['family'],
        'alone': len(rows) == 1,
    }


def _several(truth: dict, answer: dict, facts: Facts) -> dict:
    """Right: each of them is found in a row of its own; exact: and there is no other row."""
    hidden = truth['effects']
    rows = answer['effects'] if answer['verdict'] in ('named', 'ambiguous') else []
    right = any(
        all(_found(facts, one, row) for one, row in zip(hidden, some, strict=True))
        for some in permutations(rows, len(hidden))
    )
    return {'right': right, 'exact': right and len(rows) == len(hidden)}


def _outside(truth: dict, answer: dict, facts: Facts) -> dict:
    """Right: unknown, with the right variable where one variable explains it.

    Some have relatives in the catalogue and may end in an ambiguous set of at most three.
    """
    name, verdict, rows = truth['effects'][0]['name'], answer['verdict'], answer['effects']
    variable = (answer.get('unknown') or {}).get('variable')
    right = verdict == 'unknown' and variable == outside.VARIABLES.get(name, variable)
    if name in NEVER_FAR and verdict == 'ambiguous':
        right = _distinct(facts, _open(rows[0])) <= LARGEST_SET
    lone = verdict == 'named' and len(rows) == 1 and rows[0]['inclusion_probability'] > SURE
    return {'right': right, 'variable': variable, 'lone': lone}


_JUDGES = {'none': _nothing, 'effect': _single, 'pair': _several, 'triple': _several,
           'outside': _outside}  # fmt: skip


def _found(facts: Facts, hidden: dict, row: dict) -> bool:
    """Whether a row names the hidden effect, or leaves it open among few."""
    thing, rivals = _thing(hidden), _open(row)
    if len(rivals) == 1 or all(_same(facts, _thing(row), r) for r in rivals):
        return thing in rivals or _same(facts, thing, _thing(row))
    return thing in rivals and _distinct(facts, rivals) <= LARGEST_SET


def _thing(row: dict) -> Thing:
    return row['name'], row['where']


def _open(row: dict) -> set[Thing]:
    """The effects that a row leaves open, itself included."""
    near = [r for r in row['confusable_with'] if r['separable_nats'] < MARGIN_NATS]
    return {_thing(row), *map(_thing, near)}


def _same(facts: Facts, a: Thing, b: Thing) -> bool:
    return a == b or why_same(a, b, facts) is not None


def _distinct(facts: Facts, things: Iterable[Thing]) -> int:
    """How many different things there are, where those that are the same in the data are one."""
    different: list[Thing] = []
    for thing in sorted(things):
        if not any(_same(facts, thing, other) for other in different):
            different.append(thing)
    return len(different)


def _family(name: str) -> str | None:
    return EFFECTS[name].family if name in EFFECTS else None


def _errors(truth: dict, rows: list[dict]) -> list[dict]:
    """Of every parameter of the hidden effects that were named as such."""
    return [
        error
        for hidden in truth['effects'] for row in rows if _thing(row) == _thing(hidden)
        for error in parameter_errors(hidden, row)
    ]  # fmt: skip
