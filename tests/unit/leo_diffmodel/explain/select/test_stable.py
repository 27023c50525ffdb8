# SPDX-License-Identifier: Apache-2.0
"""What stays of a choice where folds are left out."""

from operator import eq

import numpy as np
import pytest
from tests.linear import posed, solved

from leo_diffmodel.explain.problem.candidates import candidates
from leo_diffmodel.explain.problem.hypothesis import Hypothesis
from leo_diffmodel.explain.select.sets import Sets
from leo_diffmodel.explain.select.stable import has, narrowed, part_of, share
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


class Straight:
    """An estimator of effects of which only the first parameter does something."""

    most_nats = np.inf

    def __init__(self, columns):
        self.columns, self.at = columns, posed(FOLD)
        self.data = sum(columns.values()) + np.random.default_rng(1).standard_normal((40, 20))

    def fitted(self, *names):
        return self.refitted(None, Hypothesis(tuple(names)))

    def refitted(self, at, hypothesis, theta=None):
        found = solved(self.at, hypothesis, self.data, self.columns)
        values = [
            v
            for c, v in zip(hypothesis.candidates, found.fit.theta, strict=True)
            for v in (v, *[0.0] * (len(c.parameters) - 1))
        ]
        wide = np.zeros((*self.data.shape, len(values)))
        fit = found.fit.__class__(
            **{
                **vars(found.fit),
                'theta': np.array(values),
                'columns': wide,
                'covariance': np.eye(len(values)),
            }
        )
        return found._replace(fit=fit)

    def ends(self, at):
        return np.asarray((self.data - at.fit.residual)[:, -2:])


@pytest.mark.parametrize(('stays', 'answer'), [(0.95, STRIBECK), (0.7, ELBOW)])
def test_a_wider_law_gives_way_where_only_the_narrower_one_stays(stays, answer):
    column = 2 * np.random.default_rng(0).standard_normal((40, 20))
    estimator = Straight({'stribeck_friction': column, 'coulomb_friction': column})
    sets = Sets(estimator, [ELBOW, STRIBECK], SETTINGS, QUIET)
    sets.add([estimator.fitted(), estimator.fitted(STRIBECK)])
    wide = round(stays * SETTINGS.gates.turns)
    turns = [frozenset({STRIBECK})] * wide + [frozenset({ELBOW})] * (SETTINGS.gates.turns - wide)
    best = narrowed(sets, sets.known[frozenset({STRIBECK})], turns, eq)
    assert best.names == {answer}


def test_an_effect_that_does_not_stay_by_any_law_is_kept_for_the_doubts():
    column = 2 * np.random.default_rng(0).standard_normal((40, 20))
    estimator = Straight({'stribeck_friction': column, 'coulomb_friction': column})
    sets = Sets(estimator, [ELBOW, STRIBECK], SETTINGS, QUIET)
    sets.add([estimator.fitted(), estimator.fitted(STRIBECK)])
    turns = [frozenset({STRIBECK})] * 40 + [frozenset({SPRING})] * 20
    best = sets.known[frozenset({STRIBECK})]
    assert narrowed(sets, best, turns, eq) is best
