# SPDX-License-Identifier: Apache-2.0
"""An effect is sure by the turns that hold it; what they choose beside it makes it `partly`."""

from types import SimpleNamespace

import pytest
from tests.simulate import PENDULUM

from leo_diffmodel.explain.decide.doubts import _is_small, beside, instead, kept, stability
from leo_diffmodel.explain.decide.verdict import decide, Named, Rest
from leo_diffmodel.explain.findings.held_out import Context
from leo_diffmodel.explain.problem.candidates import candidates
from leo_diffmodel.explain.problem.classes import Facts
from leo_diffmodel.explain.settings import SETTINGS
from leo_sim.model import Model

POOL = {c.effect.name: c for c in candidates(Model(PENDULUM))}
COULOMB, STRIBECK = POOL['coulomb_friction'], POOL['stribeck_friction']
BIAS, SCALE, OFFSET = POOL['bias_torque'], POOL['torque_scale'], POOL['encoder_offset']
SURE, NOISE = [Named('coulomb_friction:pivot', 'c = 1 N m')], Rest(1.0, 0.0)


def context(chosen, *turns):
    """A search that chose some effects, and `count` turns of each of these sets."""
    sets = [frozenset(names) for names, count in turns for _ in range(count)]
    hypothesis = SimpleNamespace(candidates=tuple(chosen))
    found = SimpleNamespace(chosen=SimpleNamespace(names=frozenset(chosen)), turns=tuple(sets),
                            final=SimpleNamespace(hypothesis=hypothesis))  # fmt: skip
    return Context(found, None, Facts(PENDULUM, False), None, 0.01, SETTINGS)


def test_a_wider_law_in_some_turns_is_the_effect():
    made = context([COULOMB, SCALE], ([COULOMB, SCALE], 40), ([STRIBECK, SCALE], 20))
    assert made.share(COULOMB) == 1.0 and instead(made, COULOMB) == []
    assert kept(made) == 1.0 and stability(made)[0]['share'] == 1.0 and beside(made) == ''


def test_a_narrower_law_in_some_turns_is_not():
    made = context([STRIBECK], ([STRIBECK], 40), ([COULOMB], 20))
    assert made.share(STRIBECK) == pytest.approx(2 / 3)
    assert instead(made, STRIBECK) == ['coulomb_friction:pivot']


def test_a_law_of_all_joints_is_that_of_each_and_the_rest_is_told():
    double = {c.label: c for c in candidates(Model('double_pendulum'))}
    elbow, both = double['coulomb_friction:elbow'], double['stribeck_friction:all']
    made = context([elbow], ([elbow], 40), ([both], 20))
    assert made.share(elbow) == kept(made) == 1.0
    assert stability(made)[0]['share'] == pytest.approx(2 / 3)
    assert beside(made) == 'beside them the held-out turns choose stribeck_friction:all in 33%'
    assert context([both], ([both], 40), ([elbow], 20)).share(both) == pytest.approx(2 / 3)


def test_turns_with_more_effects_keep_the_chosen_ones_sure_and_are_told():
    made = context([COULOMB], ([COULOMB], 40), ([COULOMB, BIAS], 20))
    assert kept(made) == 1.0 and stability(made)[0]['share'] == pytest.approx(2 / 3)
    assert beside(made) == 'beside them the held-out turns choose bias_torque:pivot in 33%'


def test_turns_without_one_of_them_are_a_doubt():
    made = context([COULOMB, BIAS], ([COULOMB, BIAS], 40), ([COULOMB, OFFSET], 20))
    assert kept(made) == pytest.approx(2 / 3)
    assert made.share(COULOMB) == 1.0 and made.share(BIAS) == pytest.approx(2 / 3)


@pytest.mark.parametrize(('chosen', 'small'), [
    ([COULOMB, BIAS, SCALE], [False, False, True]), ([COULOMB, SCALE], [False, False])])
def test_of_three_effects_those_below_the_noise_floor_are_small(chosen, small):
    made = context(chosen, (chosen, 60))
    made.__dict__['floors'] = [22.0, 1.1, 0.3] if len(chosen) == 3 else [0.9, 0.4]
    assert [_is_small(made, i) for i in range(len(chosen))] == small


@pytest.mark.parametrize(('more', 'verdict'), [(False, 'named'), (True, 'partly')])
def test_more_beside_sure_effects_is_partly(more, verdict):
    assert decide(SURE, NOISE, False, (), more) == verdict
