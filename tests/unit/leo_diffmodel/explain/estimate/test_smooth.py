# SPDX-License-Identifier: Apache-2.0
"""Which sets near a fit are fitted: those that linear algebra finds best."""

from dataclasses import replace
from importlib import import_module
from types import SimpleNamespace
from typing import NamedTuple

import numpy as np
import pytest
from tests.simulate import record, TORQUE

from leo_diffmodel.explain.estimate.choice import first_steps, Price, rivals
from leo_diffmodel.explain.estimate.estimator import Estimate
from leo_diffmodel.explain.estimate.matrices import matrices
from leo_diffmodel.explain.estimate.rounds import Rounds
from leo_diffmodel.explain.estimate.smooth import Smooth
from leo_diffmodel.explain.problem.candidates import candidates, limited
from leo_diffmodel.explain.problem.hypothesis import Hypothesis
from leo_diffmodel.explain.problem.pose import pose
from leo_diffmodel.explain.problem.sizes import scales_of
from leo_diffmodel.explain.settings import SETTINGS
from leo_msgs_py.console import Reporter
from leo_sim.effects import place
from leo_sim.model import Model

smooth = import_module('leo_diffmodel.explain.estimate.smooth')
MODEL = Model(TORQUE)
POOL = [limited(c, MODEL, SETTINGS.grids) for c in candidates(MODEL)]
FRICTION = place(TORQUE, 'coulomb_friction', 'pivot', c=0.1)
DELAY = place(TORQUE, 'command_delay', 'pivot', delay=0.02)
PRICE, NEAR = Price(10.0, 4.0), 15.0


def begun(*missing, settings=SETTINGS):
    """An estimator of a pendulum that lacks something, and the fit of the model as given."""
    posed = pose([record(TORQUE, *missing, seconds=8)], (), MODEL, settings)
    fits = Smooth(posed, scales_of(MODEL, posed.problem.windows))
    return fits, fits.first(Hypothesis())


def heard():
    return Reporter.of(lambda *_: None)


def made(*missing):
    fits, first = begun(*missing)
    return matrices(first.problem, first.fit, fits.scales, POOL)


def named(terms):
    return {t.candidate.effect.name for t in terms}


@pytest.mark.parametrize('phase', [-2.4, -0.3, 1.2, 2.9])
def test_a_ripple_of_any_phase_is_two_columns_and_its_values_are_found(phase):
    ripple = place(TORQUE, 'torque_ripple', 'pivot', a=0.02, n=3, phase=phase)
    linear = made(ripple)
    own = [t for t in linear.terms if named([t]) == {'torque_ripple'}]
    best = min(own, key=lambda t: linear.least([t])[0])
    assert all(len(t.columns) == 2 for t in own) and best.begin[1] == 3
    hypothesis, theta = linear.hypothesis([best])
    assert theta[:2] == pytest.approx([0.02, 3], rel=0.4)
    assert abs(np.angle(np.exp(1j * (theta[2] - phase)))) < 0.5
    assert hypothesis.candidates == (best.candidate,)


def test_two_that_are_missing_are_among_the_sets_near_the_model_as_given():
    linear = made(FRICTION, DELAY)
    found = [named(terms) for terms in rivals(linear, PRICE, SETTINGS, NEAR)]
    assert {'coulomb_friction', 'command_delay'} in found
    assert len({frozenset(n) for n in found}) <= SETTINGS.numerics.singles


def test_where_only_noise_is_left_nothing_is_added():
    assert rivals(made(), PRICE, SETTINGS, NEAR) == []


def test_a_set_is_fitted_from_several_whole_numbers_but_from_one_size():
    ripple = place(TORQUE, 'torque_ripple', 'pivot', a=0.05, n=3, phase=0.4)
    found = rivals(made(ripple), PRICE, SETTINGS, NEAR)
    alone = [terms for terms in found if named(terms) == {'torque_ripple'}]
    periods = [terms[0].begin[1] for terms in alone]
    assert 3 in periods and len(set(periods)) == len(periods) <= SETTINGS.numerics.begins
    assert len([t for t in found if named(t) == {'command_delay'}]) <= 1


def test_those_that_promise_most_are_fitted_and_all_have_a_scan():
    fits, first = begun(FRICTION)
    found = fits.near(first, POOL, heard())
    best = min(found.larger, key=lambda at: float(at.fit.loss.sum()))
    assert 'coulomb_friction' in {c.effect.name for c in best.names}
    assert {s.candidate for s in found.scans} <= {*POOL} and len(found.scans) > 15
    assert found.untried == () and found.threshold >= SETTINGS.gates.least_nats
    again = fits.near(best, POOL, heard())
    assert not best.names & {s.candidate for s in again.scans if not s.candidate.has_whole}


def test_an_effect_in_the_place_of_one_is_near():
    fits, first = begun(FRICTION)
    wrong = next(c for c in POOL if c.effect.name == 'viscous_friction')
    at = fits.refitted(first, Hypothesis((wrong,)))
    exchanged = [{c.effect.name for c in e.names} for e in fits.near(at, POOL, heard()).larger]
    assert {'coulomb_friction'} in exchanged


def test_near_many_effects_one_more_is_tried_and_no_pair_is_exchanged():
    few = replace(SETTINGS, gates=replace(SETTINGS.gates, many=0))
    fits, first = begun(FRICTION, DELAY)
    own = Hypothesis(tuple(c for c in POOL if c.effect.name == 'coulomb_friction'))
    at = fits.refitted(first, own)
    linear = matrices(at.problem, at.fit, fits.scales, POOL)
    found = [named(terms) for terms in rivals(linear, PRICE, few, NEAR)]
    assert {'coulomb_friction', 'command_delay'} in found
    assert all(len(names) <= 2 for names in found)


def test_far_from_the_data_one_thing_is_added_at_a_time():
    steps = first_steps(made(FRICTION, DELAY), PRICE, SETTINGS.numerics)
    assert len({frozenset(named(terms)) for terms in steps}) == SETTINGS.numerics.patience
    assert all(len(terms) == 1 for terms in steps)


@pytest.mark.parametrize('several', [True, False], ids=['several', 'one'])
def test_at_several_joints_effects_save_more_than_a_trifle_and_friction_is_plain(several):
    """A robot of one joint that counts as one of several, or not."""
    fits, first = begun(settings=SETTINGS.changed(several=1 if several else 2))
    tried = Rounds(fits, first, POOL, heard())
    linear = matrices(first.problem, first.fit, fits.scales, POOL)
    white = np.random.default_rng(0).standard_normal(first.fit.residual.shape)
    fits = [replace(first.fit, residual=by * white) for by in (1.0, 10.0)]
    noise, much = (tried._price(first.problem, each, linear).effect for each in fits)
    assert noise < 2 * linear.threshold and (much > 3 * noise) == several
    laws = {c.effect.name for c in tried._plain if c.effect.family == 'friction'}
    assert (laws == {'viscous_friction', 'coulomb_friction'}) == several
    others = [c for c in POOL if c.effect.family != 'friction']
    assert [c for c in tried._plain if c.effect.family != 'friction'] == others


class Lost(NamedTuple):
    hypothesis: Hypothesis
    loss: float

    def lost(self, _) -> float:
        return self.loss


@pytest.mark.parametrize(
    ('patience', 'losses', 'fitted'),
    [
        (2, [90.0, 95.0, 85.0, 99.0, 99.0, 99.0, 10.0], 6),
        (2, [99.9, 120.0, 10.0], 2),
        (0, [120.0, 120.0, 120.0, 10.0], 4),
    ],
)
def test_sets_are_fitted_so_many_at_a_time_as_long_as_one_is_better(
    patience, losses, fitted, monkeypatch
):
    monkeypatch.setattr(smooth, 'dispersion', lambda _: 1.0)
    monkeypatch.setattr(smooth, '_fitted', lambda problem, near, rival, point: Lost(*point))
    monkeypatch.setattr(smooth, 'replace', lambda fit, hypothesis: fit)
    problem = SimpleNamespace(train=None, until=np.inf, gates=SETTINGS.gates, late=lambda: False)
    base = Estimate(SimpleNamespace(problem=problem), Lost(Hypothesis(), 100.0))
    linear = SimpleNamespace(scans=(), threshold=8.0)
    points = [(Hypothesis(), loss) for loss in losses]
    found = smooth._fitted_all(base, linear, points, heard(), patience=patience)
    assert [at.fit.loss for at in found.larger] == losses[:fitted] and found.untried == ()
