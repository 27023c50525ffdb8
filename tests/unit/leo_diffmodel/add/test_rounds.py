# SPDX-License-Identifier: Apache-2.0
"""leo repair goes on while sure effects leave a rest; what the verbs share: times, headlines."""

import argparse
import math

import pytest

from leo_diffmodel.add.rounds import merged, rounds
from leo_diffmodel.explain.explanation import Explanation
from leo_diffmodel.explain.told import Told
from leo_diffmodel.verbs.common import seconds
from leo_sim.effects import place
from leo_sim.model import Model

PENDULUM = Model('pendulum')
FOUND = ('coulomb_friction', 'viscous_friction', 'armature')


def round_of(number: int, verdict: str) -> Explanation:
    """The answer to a model with `number` effects: one more, and errors ten times smaller."""
    placed = [place(PENDULUM.robot, name, 'pivot') for name in FOUND[: number + 1]]
    before, after = 10.0**-number, 10.0 ** -(number + 1)
    mean = {'before': before, 'after': after, 'noise_floor': 1e-9}
    one = {**{name: [error] for name, error in mean.items()}, 'mean': mean}
    steps = ('as given', before), (f'+ {FOUND[number]}', after), ('noise floor', 1e-9)
    return Explanation(
        verdict=verdict,
        told=(Told(f'Sentence {number}'),),
        effects=[{'name': FOUND[number], 'where': 'pivot'}],
        errors={
            'one_step': one,
            'horizon': [one],
            'ladder': [{'model': name, 'rmse': [error]} for name, error in steps],
        },
        seconds=1.0,
        model=PENDULUM.changed(effects=tuple(placed)),
        search=object(),  # type: ignore[arg-type]
    )


def ask(*verdicts: str):
    return lambda model, left: round_of(len(model.effects), verdicts[len(model.effects)])


@pytest.mark.parametrize(
    ('verdicts', 'within', 'count'),
    [
        (('named',), math.inf, 1),
        (('ambiguous',), math.inf, 1),
        (('unknown',), math.inf, 1),
        (('partly', 'named'), math.inf, 2),
        (('partly', 'named'), 0.5, 1),
        (('partly', 'unknown'), math.inf, 1),
        (('partly', 'ambiguous'), math.inf, 1),
        (('partly', 'partly', 'named'), math.inf, 3),
    ],
)
def test_sure_effects_are_added_as_long_as_there_are_any_and_time(verdicts, within, count):
    assert len(rounds(ask(*verdicts), PENDULUM, within)) == count


def test_rounds_are_one_answer():
    answer = merged(rounds(ask('partly', 'partly', 'named'), PENDULUM, math.inf))
    assert answer.verdict == 'named' and answer.seconds == 3.0
    assert [row['name'] for row in answer.effects] == list(FOUND)
    assert [p.effect.name for p in answer.model.effects] == list(FOUND)
    ladder = [row['model'] for row in answer.errors['ladder']]
    assert ladder == ['as given', *(f'+ {name}' for name in FOUND), 'noise floor']
    for table in (answer.errors['one_step'], answer.errors['horizon'][0]):
        assert table['mean'] == {'before': 1.0, 'after': pytest.approx(1e-3), 'noise_floor': 1e-9}


@pytest.mark.parametrize(
    ('text', 'expected'), [('60', 60.0), ('60s', 60.0), ('2m', 120.0), ('0.5 min', 30.0)]
)
def test_times(text, expected):
    assert seconds(text) == expected


@pytest.mark.parametrize('text', ['', 's', '-3', '0', 'nan', '2h'])
def test_no_times(text):
    with pytest.raises(argparse.ArgumentTypeError, match='write 60s or 2m'):
        seconds(text)
