# SPDX-License-Identifier: Apache-2.0
"""An effect is sure by the turns that hold it; what they choose beside it makes it `partly`."""

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest
from tests.simulate import PENDULUM

from leo_diffmodel.explain.decide.doubts import beside, doubt, doubts, instead
from leo_diffmodel.explain.decide.verdict import decide, Named
from leo_diffmodel.explain.estimate.fitted import Certificate, Fit, Rest
from leo_diffmodel.explain.findings.findings import Choices, Own, Part
from leo_diffmodel.explain.problem.candidates import candidates
from leo_diffmodel.explain.problem.hypothesis import Hypothesis
from leo_diffmodel.explain.settings import SETTINGS
from leo_sim.model import Model

POOL = {c.effect.name: c for c in candidates(Model(PENDULUM))}
CHOSEN = tuple(POOL[n] for n in ('coulomb_friction', 'bias_torque', 'torque_scale'))
LABELS = tuple(c.label for c in CHOSEN)
SURE, NOISE = [Named('coulomb_friction:pivot', 'c = 1 N m')], Rest(SETTINGS.gates, 1.0, 0.0)


def findings(share=1.0, floors=(), own=({}, {}, {}), **of_choices):
    """Three effects a little away from neutral, each in this share of the turns."""
    hypothesis, none = Hypothesis(CHOSEN), np.zeros((0, 0))
    theta = hypothesis.neutral + 0.1
    fit = Fit(hypothesis, theta, 1e-6 * np.eye(len(theta)), none, none, none, none)
    parts = tuple(Part(c, fit, (9.0, 9.0), {}, {}, share, ()) for c in CHOSEN)
    choices = {'kept': share, 'sets': ((LABELS, share),), 'instead': (), 'beside': ()}
    return SimpleNamespace(
        gates=SETTINGS.gates,
        numerics=SETTINGS.numerics,
        final=fit,
        effects=parts,
        floors=floors,
        own=own,
        choices=Choices(**choices | of_choices),
        other='',
        refuted='',
        search=SimpleNamespace(untried=()),
    )


def test_what_all_turns_hold_is_sure():
    made = findings()
    assert [doubt(made, part) for part in made.effects] == ['', '', ''] and doubts(made) == []


def test_what_too_few_turns_hold_is_not_and_what_they_choose_instead_is_told():
    others = (('armature:pivot', 0.3), ('velocity_lag:pivot', 0.04))
    made = findings(0.7, instead=others)
    assert doubt(made, made.effects[0]) == 'chosen in 70% of the held-out turns'
    assert doubts(made) == ['this set is chosen in 70% of the held-out turns']
    assert instead(made, made.effects[0]) == ['armature:pivot']
    sure = findings(instead=others)
    assert instead(sure, sure.effects[0]) == []


def test_more_in_too_many_turns_is_told():
    more = (('armature:pivot', 0.3), ('velocity_lag:pivot', 0.04))
    words = 'the held-out turns choose armature:pivot in 30%, velocity_lag:pivot in 4%'
    assert beside(findings(sets=((LABELS, 0.66),), beside=more)) == f'beside them {words}'
    assert beside(findings(sets=((LABELS, 0.95),), beside=more)) == ''
    assert beside(findings(sets=(((), 0.66),), beside=more)) == ''


def test_effects_below_the_noise_floor_are_small():
    made = findings(floors=(22.0, 1.1, 0.3))
    assert [bool(doubt(made, part)) for part in made.effects] == [False, False, True]


@pytest.mark.parametrize(('other', 'agree'), [(0.11, True), (0.25, False)])
def test_recordings_that_exclude_each_other_disagree(other, agree):
    first = Hypothesis(CHOSEN).offset(1)
    values = {first: [Own('run_1', 0.1, 0.001), Own('run_2', other, 0.001)]}
    told = doubts(findings(own=({}, values, {})))
    assert bool(told) is not agree
    assert all('bias_torque:pivot: t is 0.1 in run_1 and 0.25 in run_2' in doubt for doubt in told)


@pytest.mark.parametrize(('more', 'verdict'), [(False, 'named'), (True, 'partly')])
def test_more_beside_sure_effects_is_partly(more, verdict):
    assert decide(SURE, NOISE, False, (), more) == verdict


def test_what_there_was_no_time_for_is_told():
    made = findings()
    made.search.untried = ('a:pivot', 'b:pivot', 'c:pivot', 'd:pivot', 'e:pivot')
    assert doubts(made) == ['the time was over; not tried: a:pivot, b:pivot, c:pivot and 2 more']


@pytest.mark.parametrize(
    ('starts', 'said'),
    [(1, 'the fit has not come to its end'), (4, '4 starts of the fit end at different values')],
)
def test_what_has_not_converged_is_never_sure(starts, said):
    made = findings()
    made.final = replace(made.final, certificate=Certificate(3.0, starts, 1, False))
    assert doubts(made) == [said]


@pytest.mark.parametrize('named', [[], SURE])
@pytest.mark.parametrize('rest', [NOISE, Rest(SETTINGS.gates, 40.0, 0.9)])
def test_an_answer_that_was_cut_short_is_open(named, rest):
    assert decide(named, rest, False, cut_short=True) == 'ambiguous'
