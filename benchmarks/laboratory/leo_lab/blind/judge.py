# SPDX-License-Identifier: Apache-2.0
"""Judge an explanation against the truth of its case, once the verdict is in."""

from __future__ import annotations

from itertools import permutations

from leo_diffmodel.add.patch import found_rows
from leo_diffmodel.explain.problem.classes import Facts
from leo_lab.blind import outside
from leo_lab.blind.judge_small import judge_pushed, judge_small
from leo_lab.blind.parameters import parameter_errors
from leo_lab.blind.things import distinct, found, LARGEST_SET, left_open, thing
from leo_sim.description.robot import Robot
from leo_sim.effects import EFFECTS

SURE = 0.9
NEVER_FAR = ('hysteresis', 'winding_drift')
"""Laws whose nearest relatives in the catalogue may be named, as long as it stays open."""
JOINED = {'winding_drift': 'torque_fade'}
"""Laws that the catalogue has by now, by another name."""


NAMING = ('named', 'partly', 'ambiguous')


def judge(truth: dict, answer: dict, robot: Robot) -> dict:
    """One line of the results file.

    Args:
        truth: of a case, see `truth.reveal`.
        answer: the contents of explain.json.
        robot: of the case, as everybody knows it.
    """
    rows = found_rows(answer)
    named = [thing(e) for e in rows]
    return {
        **truth,
        'verdict': answer['verdict'],
        'named': [list(one) for one in named],
        'not_sure': len(rows) - len(answer['effects']),
        'set': [sorted(map(list, left_open(e))) for e in rows],
        'gain': [e['gain_train'] + e['gain_held_out'] for e in rows],
        'found': [e['parameters'] for e in rows],
        'inclusion': [e['inclusion_probability'] for e in rows],
        'chi2_ratio': answer['errors'].get('chi2_ratio'),
        'seconds': answer['seconds'],
        'errors': _errors(truth, rows),
        **_JUDGES[truth['kind']](truth, answer, Facts(robot, truth['ever_free'])),
    }


def _nothing(truth: dict, answer: dict, facts: Facts) -> dict:
    return {'right': answer['verdict'] == 'fine'}


def _single(truth: dict, answer: dict, facts: Facts) -> dict:
    """Right: the effect and its place first, alone or with what is the same in the data.

    An ambiguous set of at most three things that holds it is right as well, where a class of
    the same thing is one.
    """
    hidden, rows = truth['effects'][0], found_rows(answer)
    first = rows[0] if rows else None
    if first is None or answer['verdict'] not in NAMING:
        return {'right': False, 'family': False}
    return {
        'right': found(facts, hidden, first),
        'family': found(facts, hidden, first) or _family(first['name']) == hidden['family'],
        'alone': len(rows) == 1,
    }


def _strength(truth: dict, answer: dict, facts: Facts) -> dict:
    """As one effect; seen: something is said to be missing, whatever it is."""
    return {'seen': answer['verdict'] in (*NAMING, 'unknown'), **_single(truth, answer, facts)}


def _several(truth: dict, answer: dict, facts: Facts) -> dict:
    """Right: each of them is found in a row of its own; exact: and there is no other row."""
    hidden = truth['effects']
    rows = found_rows(answer) if answer['verdict'] in NAMING else []
    right = any(
        all(found(facts, one, row) for one, row in zip(hidden, some, strict=True))
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
        right = distinct(facts, left_open(rows[0])) <= LARGEST_SET
    if verdict in NAMING and rows[0]['name'] == JOINED.get(name):
        right = True
    sure = verdict in ('named', 'partly') and len(rows) == 1
    lone = sure and rows[0]['inclusion_probability'] > SURE
    return {'right': right, 'variable': variable, 'lone': lone}


_JUDGES = {
    'none': _nothing,
    'effect': _single,
    'pair': _several,
    'triple': _several,
    'outside': _outside,
    'small': judge_small,
    'pushed': judge_pushed,
    'strength': _strength,
}


def _family(name: str) -> str | None:
    return EFFECTS[name].family if name in EFFECTS else None


def _errors(truth: dict, rows: list[dict]) -> list[dict]:
    """Of every parameter of the hidden effects that were named as such."""
    return [
        error
        for hidden in truth['effects']
        for row in rows
        if thing(row) == thing(hidden)
        for error in parameter_errors(hidden, row)
    ]
