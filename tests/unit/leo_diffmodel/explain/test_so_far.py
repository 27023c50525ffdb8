# SPDX-License-Identifier: Apache-2.0
"""An answer is told as soon as there is one, then each better one; the last is as if none was."""

from types import SimpleNamespace

import pytest
from tests.searched import among
from tests.simulate import record, TORQUE

from leo_diffmodel.explain.explanation import explain
from leo_diffmodel.explain.settings import SETTINGS
from leo_diffmodel.explain.so_far import SoFar
from leo_sim.effects import place
from leo_sim.model import Model


@pytest.fixture(scope='module')
def told():
    """The answers on the way to that of a pendulum with friction, and that without any."""
    heard, model = [], Model(TORQUE)
    data = [record(TORQUE, place(TORQUE, 'viscous_friction', 'pivot', b=0.1), seconds=10)]
    with pytest.MonkeyPatch.context() as patch:
        among(patch, model, 'viscous_friction', 'bias_torque', 'coulomb_friction')
        last = explain(data, model, so_far=heard.append)
        return heard, last, explain(data, model)


def test_the_first_answer_has_the_values_and_the_error_of_a_joint_fit(told):
    first, last = told[0][0], told[1]
    assert (first.complete, last.complete) == (False, True)
    assert first.verdict == 'ambiguous' and first.seconds < last.seconds
    friction = {e['name']: e for e in first.effects}['viscous_friction']
    assert friction['parameters']['b']['value'] == pytest.approx(0.1, rel=0.2)
    assert friction['error_after'] < 0.3 * friction['error_before']
    assert friction['gain_train'] > 20 and friction['gain_held_out'] is not None
    before, after = first.errors['ladder']
    assert after['rmse'][0] < 0.3 * before['rmse'][0]
    assert 'nothing is sure before the end' in first.sentence
    assert 'held-out error' in first.sentence


def test_later_answers_are_hardly_worse_and_the_last_is_that_of_a_search_nobody_hears(told):
    heard, last, alone = told
    errors = [answer.effects[0]['error_after'] for answer in heard]
    assert len(heard) > 1
    assert all(now <= 1.1 * min(errors[:n]) for n, now in enumerate(errors) if n)
    assert {e['name'] for e in heard[-1].effects} == {'viscous_friction'}
    of_a_run = {'seconds': 0, 'provenance': {}}
    assert last.to_json() | of_a_run == alone.to_json() | of_a_run


@pytest.mark.parametrize(
    ('named', 'after', 'least', 'better'),
    [
        (True, 0.5, float('inf'), True),
        (True, 0.95, float('inf'), False),  # as good as what names nothing
        (False, 1.0, float('inf'), True),
        (False, 1.0, 0.5, False),
        (True, 0.54, 0.5, True),
        (True, 0.56, 0.5, False),
    ],
)
def test_what_is_no_better_is_not_told(named, after, least, better):
    found = SoFar.__new__(SoFar)
    problem = SimpleNamespace(gates=SETTINGS.gates)
    found._best = SimpleNamespace(problem=problem, names={'friction'} if named else set())
    found.before, found.after = 1.0, after
    assert found.is_better(least) is better
