# SPDX-License-Identifier: Apache-2.0
"""What is chosen where folds are left out: chosen effects by any name, and what more is."""

from types import SimpleNamespace

import pytest
from tests.simulate import PENDULUM

from leo_diffmodel.explain.findings.choices import choices
from leo_diffmodel.explain.problem.candidates import candidates
from leo_diffmodel.explain.problem.classes import Facts
from leo_sim.model import Model

POOL = {c.effect.name: c for c in candidates(Model(PENDULUM))}
COULOMB, STRIBECK = POOL['coulomb_friction'], POOL['stribeck_friction']
BIAS, SCALE, OFFSET = POOL['bias_torque'], POOL['torque_scale'], POOL['encoder_offset']


def chosen(names, *turns):
    """What is made of a search that chose some effects, and of so many turns of each set."""
    sets = [frozenset(names) for names, count in turns for _ in range(count)]
    final = SimpleNamespace(hypothesis=SimpleNamespace(candidates=tuple(names)))
    found = SimpleNamespace(
        chosen=SimpleNamespace(names=frozenset(names)), resamples=tuple(sets), final=final
    )
    return choices(found, Facts(PENDULUM, False))


def test_a_wider_law_in_some_turns_is_the_effect():
    made = chosen([COULOMB, SCALE], ([COULOMB, SCALE], 40), ([STRIBECK, SCALE], 20))
    assert made.kept == 1.0 and made.more == ()
    assert made.sets == ((('coulomb_friction:pivot', 'torque_scale:pivot'), 1.0),)


def test_a_narrower_law_in_some_turns_is_not():
    made = chosen([STRIBECK], ([STRIBECK], 40), ([COULOMB], 20))
    assert made.kept == pytest.approx(2 / 3) and made.more == ()
    assert made.instead == (('coulomb_friction:pivot', pytest.approx(1 / 3)),)


def test_a_law_of_all_joints_is_that_of_each_and_the_rest_is_told():
    double = {c.label: c for c in candidates(Model('double_pendulum'))}
    elbow, both = double['coulomb_friction:elbow'], double['stribeck_friction:all']
    made = chosen([elbow], ([elbow], 40), ([both], 20))
    assert made.kept == 1.0 and made.sets[0][1] == pytest.approx(2 / 3)
    assert made.more == (('stribeck_friction:all', pytest.approx(1 / 3)),)
    assert chosen([both], ([both], 40), ([elbow], 20)).kept == pytest.approx(2 / 3)


def test_turns_with_more_effects_keep_the_chosen_ones_and_are_told():
    made = chosen([COULOMB], ([COULOMB], 40), ([COULOMB, BIAS], 20))
    assert made.kept == 1.0 and made.sets[0][1] == pytest.approx(2 / 3)
    assert made.more == (('bias_torque:pivot', pytest.approx(1 / 3)),)


def test_turns_without_one_of_them_do_not_keep_the_set():
    made = chosen([COULOMB, BIAS], ([COULOMB, BIAS], 40), ([COULOMB, OFFSET], 20))
    assert made.kept == pytest.approx(2 / 3)
    assert made.sets[1] == (
        ('coulomb_friction:pivot', 'encoder_offset:pivot'),
        pytest.approx(1 / 3),
    )


def test_nothing_chosen_is_a_set_too():
    made = chosen([], ([], 40), ([BIAS], 20))
    assert made.sets[0] == ((), pytest.approx(2 / 3))
    assert made.sets[1] == (('bias_torque:pivot',), pytest.approx(1 / 3))
