# SPDX-License-Identifier: Apache-2.0
"""What a fit leaves: white where the model is right, correlated and too large where it is not."""

from dataclasses import replace

import numpy as np
import pytest
from tests.simulate import PENDULUM, record

from leo_diffmodel.explain.estimate.fit import fit
from leo_diffmodel.explain.estimate.fitted import Fit
from leo_diffmodel.explain.problem.hypothesis import Hypothesis
from leo_diffmodel.explain.problem.pose import pose
from leo_diffmodel.explain.problem.problem import Problem
from leo_diffmodel.report.sections.health import by_condition, chi_squared, correlation
from leo_sim.effects import place
from leo_sim.model import Model

FRICTION = place(PENDULUM, 'viscous_friction', 'pivot', b=1e-4)


@pytest.fixture(scope='module')
def problems() -> tuple[Problem, Problem]:
    """A pendulum that rubs, posed against a model without friction and against the right one."""
    data = [record(PENDULUM, FRICTION, seconds=20, seed=3)]
    return tuple(pose(data, (), Model(PENDULUM, e)).problem for e in ((), (FRICTION,)))


@pytest.fixture(scope='module')
def fits(problems) -> tuple[Fit, Fit]:
    return tuple(fit(problem, Hypothesis()) for problem in problems)


def test_what_the_right_model_leaves_is_white(problems, fits):
    found = correlation(problems[1], fits[1])
    assert found.white and found.strength < 2.0
    inside = (found.low <= found.value) & (found.value <= found.high)
    assert inside.mean() > 0.75
    assert np.median(chi_squared(fits[1])) == pytest.approx(1.0, abs=0.15)
    np.testing.assert_allclose(found.seconds, 0.01 * np.arange(1, 11))
    shape = 10, 2  # angles, then rates
    assert found.value.shape == found.low.shape == found.high.shape == shape


def test_what_a_wrong_model_leaves_is_not(problems, fits):
    found = correlation(problems[0], fits[0])
    assert not found.white and found.strength > 10.0
    assert found.value[0, 0] > found.high[0, 0]


@pytest.mark.filterwarnings('error')
def test_rates_that_nobody_measured_say_nothing(problems):
    angles = [replace(p, unseen=np.array([[False, True]])) for p in problems]
    fits = [fit(p, Hypothesis()) for p in angles]
    rounded = [replace(f, residual=f.residual + 1e-17) for f in fits]
    white = [correlation(*pair) for pair in zip(angles, rounded, strict=True)]
    assert [found.white for found in white] == [False, True]
    assert white[1].strength < 2.0 < 5.0 < white[0].strength
    for found in white:
        assert np.isfinite(found.value[:, 0]).all() and np.isnan(found.value[:, 1]).all()


def test_missing_friction_shows_at_speed(problems, fits):
    rows = by_condition(problems[0], fits[0], fits[1])
    assert {r['variable'] for r in rows} == {'speed', 'direction', 'load'}
    speed = sorted((r for r in rows if r['variable'] == 'speed'), key=lambda r: r['bin'])
    assert len(speed) == 3
    assert speed[-1]['before'] > 3 * speed[0]['before']
    assert all(r['after'] == pytest.approx(1.0, abs=0.4) for r in speed)
