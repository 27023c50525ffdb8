# SPDX-License-Identifier: Apache-2.0
"""What is chosen where folds are left out: chosen effects by any name, and what more is."""

from types import SimpleNamespace

import pytest
from tests.simulate import PENDULUM

from leo_diffmodel.explain.findings.choices import choices, others
from leo_diffmodel.explain.findings.findings import Contender
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
    chosen = SimpleNamespace(names=frozenset(names))
    found = SimpleNamespace(chosen=chosen, resamples=tuple(sets), final=final)
    return choices(found, Facts(PENDULUM, False))


DOUBLE = {c.label: c for c in candidates(Model('double_pendulum'))}
ELBOW, BOTH = DOUBLE['coulomb_friction:elbow'], DOUBLE['stribeck_friction:all']
TWO_THIRDS, THIRD = pytest.approx(2 / 3), pytest.approx(1 / 3)


@pytest.mark.parametrize(
    ('names', 'in_a_third', 'kept', 'first', 'more'),
    [
        ([COULOMB, SCALE], [STRIBECK, SCALE], 1.0, 1.0, []),
        ([STRIBECK], [COULOMB], TWO_THIRDS, TWO_THIRDS, []),
        ([ELBOW], [BOTH], 1.0, TWO_THIRDS, [BOTH]),
        ([BOTH], [ELBOW], TWO_THIRDS, TWO_THIRDS, [ELBOW]),
        ([COULOMB], [COULOMB, BIAS], 1.0, TWO_THIRDS, [BIAS]),
        ([COULOMB, BIAS], [COULOMB, OFFSET], TWO_THIRDS, TWO_THIRDS, [OFFSET]),
        ([], [BIAS], 1.0, TWO_THIRDS, [BIAS]),
    ],
    ids=['wider law', 'narrower law', 'all joints', 'one joint', 'more', 'another', 'nothing'],
)
def test_what_is_chosen_in_two_thirds_and_in_a_third(names, in_a_third, kept, first, more):
    made, labels = chosen(names, (names, 40), (in_a_third, 20)), tuple(c.label for c in names)
    assert made.kept(labels) == kept and made.sets[0] == (labels, first)
    assert made.more == tuple((c.label, THIRD) for c in more)
    others = tuple(sorted(c.label for c in in_a_third))
    assert made.sets[1:] == (() if first == 1.0 else ((others, THIRD),))


def test_a_narrower_law_is_chosen_instead():
    made = chosen([STRIBECK], ([STRIBECK], 40), ([COULOMB], 20))
    assert made.instead == (('coulomb_friction:pivot', THIRD),)


@pytest.mark.parametrize(
    ('ahead', 'said'), [(False, ('bias_torque:pivot', 8.0, (COULOMB.label,))), (True, None)]
)
def test_another_effect_that_leaves_much_less_speaks_against_the_choice(ahead, said):
    """Neither nothing nor a set that holds the choice does, whatever they leave."""
    left = {frozenset({COULOMB}): 10.0, frozenset({BIAS}): 2.0}
    left |= {frozenset(): 1.0, frozenset({COULOMB, BIAS}): 1.0}
    sets = [SimpleNamespace(names=names) for names in left]
    weight = SimpleNamespace(
        unexplained=lambda s: left[s.names],
        negligible=lambda _: 1.0,
        surely_ahead=lambda _chosen, _rival: ahead,
    )
    found = SimpleNamespace(weight=weight, chosen=sets[0], sets=sets)
    assert others(found, Facts(PENDULUM, False)) == ((Contender(*said),) if said else ())
