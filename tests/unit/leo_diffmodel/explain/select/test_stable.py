# SPDX-License-Identifier: Apache-2.0
"""What stays of a choice where folds are left out."""

from operator import eq

import numpy as np
import pytest
from tests.linear import posed, Regression

from leo_diffmodel.explain.problem.candidates import candidates
from leo_diffmodel.explain.problem.hypothesis import Hypothesis
from leo_diffmodel.explain.select import stable
from leo_diffmodel.explain.select.sets import Sets, supported
from leo_diffmodel.explain.select.stable import has, narrowed, part_of, resamples, share
from leo_diffmodel.explain.settings import SETTINGS
from leo_msgs_py.console import Reporter
from leo_sim.model import Model

FOLD = np.repeat(np.arange(10), 4)
QUIET = Reporter.of(lambda _: None)
ARM = {c.label: c for c in candidates(Model('double_pendulum'))}
ELBOW, BOTH = ARM['coulomb_friction:elbow'], ARM['coulomb_friction:all']
STRIBECK, WIDEST = ARM['stribeck_friction:elbow'], ARM['stribeck_friction:all']
SPRING, SCALE = ARM['joint_spring:elbow'], ARM['torque_scale:elbow']


@pytest.mark.parametrize(
    ('part', 'whole'),
    [(ELBOW, BOTH), (ELBOW, STRIBECK), (ELBOW, WIDEST), (BOTH, WIDEST), (STRIBECK, WIDEST)],
)
def test_a_narrower_law_and_one_joint_are_part_of_a_wider_law_and_of_all(part, whole):
    assert part_of(part, whole) and not part_of(whole, part)


@pytest.mark.parametrize('other', [ARM['coulomb_friction:shoulder'], SPRING, SCALE])
def test_another_joint_or_law_is_none(other):
    assert not part_of(ELBOW, other) and not part_of(other, ELBOW)
    assert not has([other], ELBOW, eq)


def test_the_share_is_of_turns_that_hold_all_of_them():
    turns = [frozenset({BOTH, SCALE})] * 6 + [frozenset({STRIBECK})] * 4
    assert share(turns, [ELBOW], eq) == 1.0 and share(turns, [ELBOW, SCALE], eq) == 0.6
    assert share(turns, [SCALE], lambda a, b: True) == 1.0


def rival_laws() -> Sets:
    """Nothing, the narrower and the wider law, which do the same."""
    rng = np.random.default_rng(0)
    column, noise = 2 * rng.standard_normal((40, 20)), rng.standard_normal((40, 20))
    columns = dict.fromkeys(('stribeck_friction', 'coulomb_friction'), column)
    estimator = Regression(column + noise, columns, posed(FOLD))
    sets = Sets(estimator, [ELBOW, STRIBECK], SETTINGS, QUIET)
    sets.add(estimator.first(Hypothesis(names)) for names in ((), (ELBOW,), (STRIBECK,)))
    return sets


def test_a_wider_law_that_does_no_more_is_not_supported():
    sets = rival_laws()
    known = [*sets.known.values()]
    sure = {s.names for s in known if supported(known, s, sets.weight, sets.threshold)}
    assert {ELBOW} in sure and {STRIBECK} not in sure


def test_a_tenth_of_the_folds_is_left_out_of_each_resample(monkeypatch):
    monkeypatch.setattr(stable, 'chosen', lambda known, weight, limit: tuple(weight.folds))
    turns = resamples(rival_laws())
    assert {len(folds) for folds in turns} == {9} and len(set(turns)) == 10


@pytest.mark.parametrize(
    ('wide', 'others', 'answer'),
    [(57, ELBOW, STRIBECK), (42, ELBOW, ELBOW), (40, SPRING, STRIBECK)],
    ids=['it stays', 'only the narrower stays', 'no law of it stays'],
)
def test_a_wider_law_gives_way_where_only_the_narrower_one_stays(wide, others, answer):
    """What stays by no law is kept for the doubts."""
    sets = rival_laws()
    turns = [frozenset({STRIBECK})] * wide + [frozenset({others})] * (60 - wide)
    best = narrowed(sets, sets.known[frozenset({STRIBECK})], turns, eq)
    assert best.names == {answer}
