# SPDX-License-Identifier: Apache-2.0
"""Predictions are integrated as finely as the data ask, their sensitivities more coarsely."""

from dataclasses import replace

import numpy as np
import pytest
from tests.searched import among
from tests.simulate import measured_torque, PENDULUM, POSITION, record, TORQUE

from leo_diffmodel.explain.estimate.fit import fit
from leo_diffmodel.explain.estimate.fitted import unexplained
from leo_diffmodel.explain.estimate.settle import settle
from leo_diffmodel.explain.explanation import explain
from leo_diffmodel.explain.problem.candidates import candidates, limited
from leo_diffmodel.explain.problem.hypothesis import Hypothesis
from leo_diffmodel.explain.problem.likelihood import degrees
from leo_diffmodel.explain.problem.pose import pose, refined
from leo_diffmodel.explain.select.search import search
from leo_diffmodel.explain.settings import SETTINGS
from leo_sim.effects import place
from leo_sim.model import Model

EXACT, NEARLY = (1e-6, 1e-4), (1e-4, 1e-3)
COUNT = 'actuators.pivot.resolution'
FINE = Model(TORQUE, integration_step=2e-4)


@pytest.fixture(scope='module')
def problem():
    friction = place(TORQUE, 'viscous_friction', 'pivot', b=0.1)
    data = record(TORQUE, friction, seconds=12, noise=EXACT, integration_step=2e-4)
    return pose([data], (), FINE).problem


def drag() -> Hypothesis:
    one = next(c for c in candidates(FINE) if c.label == 'viscous_friction:pivot')
    return Hypothesis((limited(one, FINE, SETTINGS.grids),))


def test_what_is_predicted_stays_fine_and_its_slope_is_nearly_the_same(problem):
    fine = replace(problem, rough_step=None)
    theta, start = np.array([0.05]), problem.windows.measured[:, 0]
    rough, exact = (p.linearised(drag(), theta, start) for p in (problem, fine))
    assert problem.base.integration_step < problem.rough_step == SETTINGS.numerics.longest_step
    assert np.array_equal(rough.residual, exact.residual)
    for a, b in ((rough.by_theta, exact.by_theta), (rough.by_start, exact.by_start)):
        assert 0 < np.linalg.norm(a - b) < 0.05 * np.linalg.norm(b)


def test_a_step_that_is_fine_enough_without_a_lag_is_halved_for_a_fit_with_one():
    model, tau = Model(POSITION, integration_step=1e-3), 4.1e-3
    dead = place(POSITION, 'voltage_deadband', 'pivot', v=2.27)
    lag = place(POSITION, 'actuator_lag', 'pivot', tau=tau)
    data = record(POSITION, dead, lag, seconds=8, noise=(6e-4, 0.06), integration_step=1e-4)
    posed, pool = pose([data], (), model), candidates(model)
    assert refined(posed, fit(posed.problem, Hypothesis()).point, 1e-3) is posed
    both = [next(c for c in pool if c.effect.name == e.effect.name) for e in (dead, lag)]
    both = Hypothesis(tuple(limited(c, model, SETTINGS.grids) for c in both))
    rough = fit(posed.problem, both, np.array([2.2, 3e-3]))
    finer = refined(posed, rough.point, 1e-3).problem
    assert finer.base.integration_step == 0.5 * posed.problem.base.integration_step
    assert posed.problem.rough_step > finer.rough_step
    fine = fit(finer, both, rough.theta, rough.start, thorough=True)
    assert fine.loss.sum() < rough.loss.sum() - 10.0
    assert fine.theta[1] == pytest.approx(tau, abs=4.0 * fine.standard_errors[1])


@pytest.mark.parametrize(('step', 'noted'), [(2.5e-4, True), (0.01, False)])
def test_a_step_too_long_for_the_motion_is_halved_and_said(step, noted, monkeypatch):
    among(monkeypatch, Model(TORQUE), 'viscous_friction', 'coulomb_friction', 'bias_torque')
    friction = place(TORQUE, 'viscous_friction', 'pivot', b=0.02)
    data = record(TORQUE, friction, seconds=10, noise=NEARLY, integration_step=step)
    found = explain([data], Model(TORQUE, integration_step=0.01))
    assert [e['name'] for e in found.effects] == ['viscous_friction']
    assert ('10 ms of the robot are too long' in found.sentence) == noted


@pytest.mark.parametrize(('step', 'shorter'), [(2e-4, True), (2.5e-3, False)])
def test_the_last_fit_has_shorter_steps_where_these_fit_better(step, shorter, monkeypatch):
    """Friction by load is off with the robot's own, but of a robot that has these itself."""
    model, true = Model(PENDULUM, integration_step=2.5e-3), np.array([0.035, 0.01])
    among(monkeypatch, model, 'directional_load_friction')
    friction = place(PENDULUM, 'directional_load_friction', 'pivot', mu=true[0], mu_back=true[1])
    data = record(PENDULUM, friction, seconds=14, noise=(2e-4, 5e-3), integration_step=step)
    found = search([data], model, pose([data], (), model))
    assert (found.problem.base.integration_step < 2.5e-3) == shorter
    assert np.all(np.abs(found.final.theta - true) < 3 * found.final.standard_errors)


def test_what_start_states_do_is_found_again_at_the_end_and_nearby_will_do(problem):
    """A fit that begins with what another one found ends at the same place."""
    first = fit(problem, drag())
    exact = problem.linearised(drag(), first.theta, first.start).by_start
    np.testing.assert_allclose(first.by_start, exact, atol=1e-9 * np.abs(exact).max())
    near = fit(problem, Hypothesis())
    other = fit(problem, drag(), start=near.start, by_start=near.by_start)
    assert other.ended and first.ended
    assert other.theta == pytest.approx(first.theta, abs=0.1 * first.standard_errors[0])


def test_counts_of_a_servo_are_left_out_and_stay_in_the_model():
    """Of a loop that counts, a start moved by a little would see a staircase without a slope."""
    coarse = Model(POSITION)
    coarse = coarse.changed(constants={**coarse.constants, COUNT: 0.02})
    posed = pose([record(POSITION, seconds=6)], (), coarse).problem
    assert posed.base.constants[COUNT] == 0.0 and coarse.constants[COUNT] == 0.02
    assert posed.base.constants == coarse.constants | {COUNT: 0.0}
    start = posed.windows.measured[:, 0]
    nothing = Hypothesis(), np.zeros(0)
    here, there = (posed.linearised(*nothing, start + by).by_start for by in (0.0, 1e-4))
    assert np.linalg.norm(here - there) < 0.02 * np.linalg.norm(here)


def test_a_fit_ends_where_the_fine_one_does(problem):
    rough, fine = (fit(p, drag()) for p in (problem, replace(problem, rough_step=None)))
    error = np.sqrt(fine.covariance[0, 0])
    assert rough.theta == pytest.approx(fine.theta, abs=0.1 * error)
    assert rough.theta == pytest.approx(0.1, abs=5 * error)


def test_rates_that_nobody_measured_say_nothing():
    """Rates differentiated at 30 Hz are smoother than the robot's: a lag would explain that."""
    friction = place(TORQUE, 'viscous_friction', 'pivot', b=0.1)
    fast = record(TORQUE, friction, seconds=60, noise=(4e-4, 0.0), integration_step=5e-4)
    (whole,) = fast.episodes
    parts = {name: x if x is None else x[::3] for name, x in vars(whole).items()}
    slow = replace(whole, **parts)
    made = replace(slow, dq=np.gradient(slow.q, slow.t, axis=0))
    model, bag = Model(TORQUE, (friction,)), replace(fast, episodes=(made,))
    bags = [replace(bag, rates=rates) for rates in ('measured', 'absent')]
    measured, absent = (pose([each], (), model).problem for each in bags)
    first, second = (fit(p, Hypothesis()) for p in (measured, absent))
    rows = second.residual.reshape(len(second.residual), -1, 2)
    assert (rows[..., 1] == 0).all() and (rows[..., 0] != 0).all()
    assert unexplained(second) == pytest.approx(1.0, abs=0.1) and unexplained(first) > 1.1
    assert (degrees(second.residual, 2) == rows.shape[1] - 2).all()


def test_a_fit_that_stays_far_behind_is_given_up(problem):
    assert fit(problem, drag()).ended
    assert not fit(problem, drag(), rival=-1e9).ended


def test_a_thorough_fit_ends_at_one_loss_wherever_it_begins(problem):
    ends = [fit(problem, drag(), np.array([b]), thorough=True) for b in (0.0, 0.05, 0.2)]
    losses = [float(f.loss[problem.train].sum()) for f in ends]
    assert np.ptp(losses) < SETTINGS.numerics.same_nats


def test_start_states_of_a_thorough_fit_have_less_left_to_save():
    held = place(TORQUE, 'coulomb_friction', 'pivot', c=0.2)
    problem = pose([record(TORQUE, held, seconds=30)], (), Model(TORQUE, (held,))).problem
    left = [left_to_save(problem, fit(problem, drag(), thorough=t)) for t in (True, False)]
    assert left[0] < left[1]


def left_to_save(problem, fitted):
    weighed, begins = replace(problem, typical=fitted.typical), (fitted.start,)
    least = settle(weighed, fitted.hypothesis, fitted.theta, begins, nats=1e-6)
    return float((fitted.loss - least.loss)[problem.train].sum())


def test_a_noisy_torque_that_is_said_leaves_nothing_unexplained():
    robot, data = measured_torque(0.4, record(TORQUE, seconds=40))
    said, exact = (pose([data], (), Model(r)).problem for r in (robot, TORQUE))
    assert unexplained(fit(exact, Hypothesis())) > SETTINGS.gates.unexplained
    assert unexplained(fit(said, Hypothesis())) < 1.1


@pytest.mark.parametrize('seconds', [0.6, 1.2])
def test_a_noisy_torque_of_no_window_says_no_more_than_that_there_is_none(seconds):
    robot, data = measured_torque(0.05, record(TORQUE, seconds=seconds))
    problem = pose([data], (), Model(robot)).problem
    assert 0 <= problem.windows.count < SETTINGS.gates.fewest_windows
