# SPDX-License-Identifier: Apache-2.0
"""The search: what it may see, what counts as evidence, several effects, refitted constants."""

from dataclasses import replace
import time

import numpy as np
import pytest
from tests.searched import among, searched
from tests.simulate import PENDULUM, record, rounded, TORQUE

from leo_diffmodel.compare.windows import every
from leo_diffmodel.explain.estimate.fit import fit
from leo_diffmodel.explain.estimate.fitted import dispersion
from leo_diffmodel.explain.estimate.imitation import imitations
from leo_diffmodel.explain.estimate.scan import Scanner
from leo_diffmodel.explain.explanation import explain
from leo_diffmodel.explain.problem.candidates import candidates, limited, uncertain
from leo_diffmodel.explain.problem.hypothesis import Hypothesis
from leo_diffmodel.explain.problem.pose import pose
from leo_diffmodel.explain.problem.sizes import scales_of
from leo_diffmodel.explain.select.search import Search, search
from leo_diffmodel.explain.settings import SETTINGS
from leo_msgs_py.console import Reporter
from leo_sim.description.robot import load_robot
from leo_sim.effects import place
from leo_sim.model import Model
from leo_sim.model.model_file import load_model

SEEDS = range(20, 25)
TWO = (
    place(TORQUE, 'coulomb_friction', 'pivot', c=0.2),
    place(TORQUE, 'command_delay', 'pivot', delay=0.02),
)
FEW = ('coulomb_friction', 'viscous_friction', 'stribeck_friction', 'command_delay', 'bias_torque')


def candidate(model, name):
    return next(c for c in candidates(model) if c.effect.name == name)


def names(found: Search) -> set[str]:
    return {c.effect.name for c in found.chosen.names}


@pytest.fixture(scope='module')
def clean() -> list[Search]:
    """Single effects on bags without any."""
    each = [((PENDULUM, TORQUE)[seed % 2], seed) for seed in SEEDS]
    return [searched([record(robot, seconds=8, seed=s)], Model(robot)) for robot, s in each]


def test_noise_alone_stays_below_the_threshold(clean):
    for found in clean:
        assert names(found) == set() and not any(found.resamples)
        empty = found.known(frozenset())
        saved = [found.weight.compare(empty, s)[0] for s in found.sets if s.names]
        assert max(saved, default=0.0) < found.threshold
        assert 8.0 <= found.threshold < 40.0


def test_what_is_left_of_clean_data_is_white(clean):
    left = [dispersion(found.null) for found in clean]
    assert 1.0 <= np.median(left) < 1.15 and max(left) < 1.5


def test_a_scan_has_points_where_the_robot_hardly_moves():
    """Below every plausible rate at which friction falls to its dynamic level."""
    model = Model(TORQUE)
    problem = pose([record(TORQUE, seconds=8)], [], model).problem
    null = fit(problem, Hypothesis())
    slow = replace(scales_of(model, problem.windows), rate=1e-3)
    law = limited(candidate(model, 'stribeck_friction'), model, SETTINGS.grids)
    scan = Scanner(problem, null, slow).scan(law)
    assert len(scan.points) and np.isfinite(scan.gain)


def test_a_scan_finds_a_lag_much_shorter_than_those_it_tries():
    model, law = Model(TORQUE), place(TORQUE, 'actuator_lag', 'pivot', tau=0.0004)
    problem = pose([record(TORQUE, law, seconds=8, noise=(1e-5, 1e-4))], [], model).problem
    scanner = Scanner(problem, fit(problem, Hypothesis()), scales_of(model, problem.windows))
    scan = scanner.scan(candidate(model, 'actuator_lag'))
    assert scan.own == pytest.approx([0.0004], rel=0.1) and scan.gain > 100


def test_a_wider_law_is_fitted_from_the_narrower_one_too(monkeypatch):
    """A law with three parameters may come to rest behind the one that is part of it."""
    model = Model(TORQUE)
    among(monkeypatch, model, 'coulomb_friction', 'stribeck_friction')
    law = place(TORQUE, 'stribeck_friction', 'pivot', c=0.2, c_static=0.35, v_s=1.0)
    found = searched([record(TORQUE, law, seconds=8)], model)
    assert names(found) == {'stribeck_friction'}
    off = found.final.theta[:3] - (0.2, 0.35, 1.0)
    assert (np.abs(off) < 5 * found.final.standard_errors[:3]).all()


def test_the_largest_effect_comes_first(monkeypatch):
    among(monkeypatch, Model(TORQUE), *FEW, 'voltage_scale', 'torque_scale')
    rubs = place(TORQUE, 'coulomb_friction', 'pivot', c=0.1)
    weak = place(TORQUE, 'voltage_scale', 'pivot', k=0.7)
    found = searched([record(TORQUE, rubs, weak, seconds=10)], Model(TORQUE))
    first, second = found.final.hypothesis.candidates
    assert first.effect.name in ('voltage_scale', 'torque_scale')
    assert second.effect.name == 'coulomb_friction'
    assert found.final.theta == pytest.approx([0.7, 0.1], rel=0.1)
    assert found.final.ci95(1)[0] < 0.1 < found.final.ci95(1)[1]


def test_held_out_data_never_move_a_fit():
    friction = place(TORQUE, 'coulomb_friction', 'pivot', c=0.2)
    problem = pose([record(TORQUE, friction)], [], Model(TORQUE)).problem
    hypothesis = Hypothesis((candidate(Model(TORQUE), 'coulomb_friction'),))
    held = ~problem.train
    assert 4 < held.sum() < problem.train.sum()
    q = problem.windows.q.copy()
    q[held] += np.random.default_rng(0).normal(0, 0.3, q[held].shape)
    changed = replace(problem, windows=replace(problem.windows, q=q))
    start = fit(problem, Hypothesis()).start
    thetas = [fit(p, hypothesis, np.array([0.14]), start).theta for p in (problem, changed)]
    np.testing.assert_allclose(*thetas, rtol=1e-9)
    np.testing.assert_allclose(thetas[0], 0.2, rtol=0.05)


@pytest.fixture(scope='module', params=[1, pytest.param(2, marks=pytest.mark.slow)])
def both(request) -> list:
    """Three bags with two effects."""
    return [record(TORQUE, *TWO, seconds=5, seed=10 * request.param + s) for s in range(3)]


def test_neither_the_order_nor_the_rate_of_the_data_changes_the_names(both, monkeypatch):
    right = {'coulomb_friction', 'command_delay'}
    among(monkeypatch, Model(TORQUE), *FEW)
    assert names(searched(both, Model(TORQUE))) == right
    among(monkeypatch, Model(TORQUE), *FEW[::-1])
    halved = [rounded(every(bag, [2])) for bag in both[::-1]]
    assert len(halved[0].episodes[0].t) == 250
    assert names(searched(halved, Model(TORQUE))) == right


@pytest.mark.parametrize(
    ('truth', 'right'),
    [
        ({'stribeck_friction': {'c': 0.1, 'c_static': 0.25, 'v_s': 1.0}}, {'stribeck_friction'}),
        (
            {'coulomb_friction': {'c': 0.1}, 'viscous_friction': {'b': 0.05}},
            {'coulomb_friction', 'viscous_friction'},
        ),
        ({'coulomb_friction': {'c': 0.2}}, {'coulomb_friction'}),
    ],
    ids=['stribeck', 'two', 'coulomb'],
)
def test_friction_is_told_by_the_fewest_laws_that_do_it(truth, right, monkeypatch):
    among(monkeypatch, Model(TORQUE), *FEW)
    effects = [place(TORQUE, name, 'pivot', **values) for name, values in truth.items()]
    found = searched([record(TORQUE, *effects, seconds=10)], Model(TORQUE))
    assert names(found) == right


def test_one_effect_is_preferred_to_two_that_do_what_it_does(monkeypatch):
    data = record(PENDULUM, place(PENDULUM, 'back_emf_scale', 'pivot', k=1.3), seconds=10)
    model = Model(PENDULUM)
    among(monkeypatch, model, 'voltage_scale', 'torque_scale', 'back_emf_scale')
    found = searched([data], model)
    assert names(found) == {'back_emf_scale'}
    assert found.final.theta == pytest.approx([1.3], rel=0.05)


def pulled():
    """Of data with a constant torque: the problem, its fit without, a scanner, and the model."""
    data, model = record(TORQUE, place(TORQUE, 'bias_torque', 'pivot', t=0.2)), Model(TORQUE)
    problem = pose([data], [], model).problem
    null = fit(problem, Hypothesis())
    return problem, null, Scanner(problem, null, scales_of(model, problem.windows)), model


def test_what_comes_near_to_a_torque_that_was_found():
    problem, _, scanner, model = pulled()
    scans = [scanner.scan(c) for c in candidates(model)]
    fitted = fit(problem, Hypothesis((candidate(model, 'bias_torque'),)))
    (near,) = imitations(problem, fitted, scans)
    assert near.candidate.effect.name == 'joint_spring'
    k, rest = near.theta
    angles = problem.windows.q
    np.testing.assert_allclose(-k * (angles - rest), fitted.theta[0], rtol=0.3)
    scaled = Hypothesis((candidate(model, 'torque_scale'),))
    assert imitations(problem, fit(problem, scaled), scans) == []


def test_ripples_of_other_periods_come_near_where_a_joint_moves_little():
    problem, null, scanner, model = pulled()
    held = replace(problem, windows=replace(problem.windows, q=1.0 + 0.05 * problem.windows.q))
    ripple = candidate(model, 'torque_ripple')
    scan = scanner.scan(ripple)
    theta = np.array([0.5, 3.0, 0.8])
    fitted = replace(null, hypothesis=Hypothesis((ripple,)), theta=theta)
    found = [s.theta for s in imitations(held, fitted, [scan])]
    assert {n for _, n, _ in found} <= {1, 2, 4, 5} and len(found) == 2
    for a, n, phase in found:
        there = a * np.sin(n * held.windows.q + phase)
        asked = 0.5 * np.sin(3 * held.windows.q + 0.8)
        assert ((there - asked) ** 2).mean() < 0.05 * (asked**2).mean()


def test_what_a_parameter_at_its_bound_cannot_do_another_that_does_the_same_makes_up_for():
    robot = load_robot('servo_pendulum')
    model = Model(robot)
    low = robot.constants['sensors.pivot.offset'].uncertain[0]
    data = [record(robot, place(robot, 'encoder_offset', 'pivot', o=2 * low))]
    problem = pose(data, [], model).problem
    null = fit(problem, Hypothesis(constants=uncertain(model)))
    hypothesis = null.hypothesis.with_candidate(candidate(model, 'encoder_offset'))
    for own in (0.0, 1.0):
        found = fit(problem, hypothesis, np.r_[own, null.theta], null.start)
        assert found.theta[0] + found.theta[-1] == pytest.approx(2 * low, abs=2e-3)


@pytest.mark.parametrize('seed', [*(pytest.param(n, marks=pytest.mark.slow) for n in (1, 4)), 2])
def test_a_constant_at_its_bound_hides_no_effect(seed, monkeypatch):
    robot = load_robot('servo_pendulum')
    near = 'encoder_offset actuator_lag command_delay measurement_delay velocity_lag bias_torque'
    among(monkeypatch, Model(robot), *near.split(), 'link_com', 'viscous_friction')
    low = robot.constants['sensors.pivot.offset'].uncertain[0]
    off = place(robot, 'encoder_offset', 'pivot', o=2 * low)
    lags = place(robot, 'actuator_lag', 'pivot', tau=0.01)
    answer = explain([record(robot, off, lags, seconds=15, seed=seed)], Model(robot))
    assert {e['name'] for e in answer.found} == {'encoder_offset', 'actuator_lag'}


def test_uncertain_constants_are_refitted_before_anything_is_named(tmp_path):
    path = 'actuators.pivot.torque_constant'
    model = tmp_path / 'rough.yaml'
    model.write_text(
        'robot: pendulum\nconstants:\n'
        f'  {path}: {{value: 0.045, unit: N m/A, uncertain: [0.03, 0.08]}}\n'
    )
    data = [record(PENDULUM, seconds=15, seed=3)]
    answer = explain(data, load_model(model))
    assert answer.verdict == 'fine' and answer.effects == []
    found = answer.constants[path]
    assert found['value'] == pytest.approx(0.0536, rel=0.01) and found['unit'] == 'N m/A'
    assert found['ci95'][0] < 0.0536 < found['ci95'][1]
    assert answer.model.constants[path] == found['value']
    sure = load_model('pendulum').changed(constants={path: 0.045})
    assert names(searched(data, sure)) != set()


def late_search(robot, until, monkeypatch):
    """The search of a weak pendulum that has this long, from among three effects."""
    among(monkeypatch, Model(robot), 'viscous_friction', 'bias_torque', 'coulomb_friction')
    data = [record(robot, place(robot, 'viscous_friction', 'pivot', b=0.05), seconds=8)]
    model = Model(robot)
    return search(data, model, pose(data, [], model), SETTINGS, until=until)


def test_a_search_without_time_says_what_it_left(monkeypatch):
    found = late_search(TORQUE, 0.0, monkeypatch)
    assert not found.complete and len(found.sets) <= 2
    labels = {'viscous_friction:pivot', 'bias_torque:pivot', 'coulomb_friction:pivot'}
    assert labels <= set(found.untried)


def test_a_search_with_time_left_leaves_nothing_untried(monkeypatch):
    found = late_search(TORQUE, time.monotonic() + 3600.0, monkeypatch)
    assert names(found) == {'viscous_friction'} and found.complete and found.untried == ()
    assert found.final.certificate.converged


def test_a_search_hears_how_much_is_to_come(monkeypatch):
    among(monkeypatch, Model(TORQUE), 'viscous_friction', 'bias_torque')
    data, model, told = [record(TORQUE, seconds=8)], Model(TORQUE), Reporter(lambda _: None)
    search(data, model, pose(data, [], model), SETTINGS, progress=told)
    scans, fits = told.clock.paces['scan'], told.clock.paces['fit']
    assert scans.done >= 2 and fits.done > 2 and scans.seconds > 0 and fits.seconds > 0
