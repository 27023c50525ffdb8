# SPDX-License-Identifier: Apache-2.0
"""Evidence from folds that a hypothesis was not fitted to."""

from dataclasses import replace

import numpy as np
import pytest
from tests.linear import free, posed, scored, solved
from tests.simulate import record, TORQUE

from leo_diffmodel.explain.estimate.estimator import Estimate
from leo_diffmodel.explain.estimate.fit import fit
from leo_diffmodel.explain.problem.candidates import candidates
from leo_diffmodel.explain.problem.hypothesis import Hypothesis
from leo_diffmodel.explain.problem.pose import pose
from leo_diffmodel.explain.select.evidence import _moves, score, weigh, Weight
from leo_diffmodel.explain.settings import SETTINGS
from leo_sim.effects import place
from leo_sim.model import Model

PLAIN = Weight(spread=1.0, samples=1000.0, most=np.inf, gates=SETTINGS.gates)
FOLD = np.repeat(np.arange(8), 5)


def test_the_left_out_loss_is_that_of_a_refit_where_all_is_straight():
    rng, names = np.random.default_rng(0), ['armature', 'bias_torque']
    columns = {n: 0.1 * rng.standard_normal((40, 20)) for n in names}
    data = sum(columns.values()) + 0.3 * rng.standard_normal((40, 20))
    found = score(solved(posed(FOLD), free(names), data, columns))
    for fold in range(8):
        out = fold == FOLD
        rest = {n: c[~out] for n, c in columns.items()}
        theta = solved(posed(FOLD[~out]), free(names), data[~out], rest).fit.theta
        left = data[out] - sum(t * columns[n][out] for t, n in zip(theta, names, strict=True))
        assert found.left[out].sum() == pytest.approx(0.5 * (left**2).sum(), rel=1e-6)
    assert found.left.sum() > found.fit.loss.sum()


@pytest.mark.filterwarnings('error')
def test_a_parameter_that_one_fold_alone_tells_stays_where_it_is_without_it():
    names = ['armature', 'bias_torque']
    columns = {n: np.random.default_rng(0).standard_normal((40, 20)) for n in names}
    columns['bias_torque'] = np.where(FOLD[:, None] == 0, 1.0 + columns['armature'] ** 2, 0.0)
    data = sum(columns.values()) + np.random.default_rng(1).standard_normal((40, 20))
    found = solved(posed(FOLD), free(names), data, columns).fit
    moves = _moves(found, found.residual, found.columns, FOLD, SETTINGS.numerics)
    assert moves[0][1] == 0.0 != moves[0][0] and np.isfinite(list(moves.values())).all()


@pytest.fixture(scope='module')
def misfit():
    """A robot with friction of another kind than the one that is fitted, and a delay."""
    rubs = place(TORQUE, 'coulomb_friction', 'pivot', c=0.1)
    effects = rubs, place(TORQUE, 'command_delay', 'pivot', delay=0.005)
    problem = pose([record(TORQUE, *effects, seconds=12)], [], Model(TORQUE))
    names = ('viscous_friction', 'torque_scale')
    held = tuple(c for n in names for c in candidates(Model(TORQUE)) if c.effect.name == n)
    fitted = fit(problem.problem, Hypothesis(held))
    return Estimate(problem, fitted)


def test_the_left_out_loss_is_nearly_that_of_a_refit_of_a_robot(misfit):
    problem, joint, found = misfit.problem, misfit.fit, score(misfit)
    train = np.flatnonzero(problem.train)
    np.testing.assert_array_equal(found.fold, problem.fold[train])
    refitted = np.zeros(len(train))
    for fold in np.unique(found.fold):
        less = replace(problem, train=problem.train & (problem.fold != fold))
        again = fit(less, joint.hypothesis, joint.theta, joint.start)
        refitted[found.fold == fold] = again.loss[train][found.fold == fold]
    assert found.left.sum() == pytest.approx(refitted.sum(), rel=0.03)
    more, truth = (x - joint.loss[train] for x in (found.left, refitted))
    assert truth.sum() > 50.0 and more.sum() == pytest.approx(truth.sum(), rel=0.2)
    weight = weigh([found])
    assert weight.spread > 1.0 and weight.samples < joint.residual.size


def test_a_parameter_on_its_bound_is_not_moved_by_a_fold():
    rng = np.random.default_rng(1)
    columns = {'armature': 0.1 * rng.standard_normal((40, 20))}
    data = columns['armature'] + 0.3 * rng.standard_normal((40, 20))
    at = solved(posed(FOLD), free(['armature']), data, columns)
    (wide,) = at.fit.hypothesis.candidates
    bound = tuple(replace(p, high=float(at.fit.theta[0])) for p in wide.parameters)
    narrow = Hypothesis((replace(wide, parameters=bound),))
    found = score(Estimate(at.posed, replace(at.fit, hypothesis=narrow)))
    np.testing.assert_array_equal(found.left, at.fit.loss)


def test_folds_that_agree_make_a_small_error_and_folds_that_do_not_a_large_one():
    empty = scored([], np.full(40, 20.0), FOLD)
    steady = scored(['armature'], np.full(40, 18.0), FOLD)
    apart = scored(['armature'], 18.0 + 6.0 * np.where(FOLD % 2, 1.0, -1.0), FOLD)
    (nats, sure), (same, unsure) = PLAIN.compare(empty, steady), PLAIN.compare(empty, apart)
    assert nats == same == pytest.approx(80.0)
    assert sure < 1e-6 and unsure > 60.0
    assert PLAIN.supports(empty, steady, 8.0)
    assert not PLAIN.supports(empty, apart, 8.0)


def test_a_fold_that_cannot_show_an_effect_does_not_disagree():
    before = np.full(40, 20.0)
    saved = np.where(FOLD < 4, 4.0, 0.0)
    larger = scored(['armature'], before - saved, FOLD)
    nats, error = PLAIN.compare(scored([], before, FOLD), larger)
    assert nats == pytest.approx(80.0) and error < 1e-6


def test_a_gain_below_what_noise_gives_does_not_count():
    empty = scored([], np.full(40, 20.0), FOLD)
    larger = scored(['armature'], np.full(40, 19.5), FOLD)
    assert PLAIN.compare(empty, larger)[0] == pytest.approx(20.0)
    assert PLAIN.supports(empty, larger, 15.0) and not PLAIN.supports(empty, larger, 25.0)
    half = replace(PLAIN, folds=np.arange(4))
    assert half.compare(empty, larger)[0] == pytest.approx(10.0)


def test_a_single_window_may_not_decide():
    flipped = np.full(40, 20.0)
    flipped[7] = 500.0
    empty, larger = scored([], flipped, FOLD), scored(['armature'], np.full(40, 20.0), FOLD)
    limited = replace(PLAIN, most=6.0)
    assert PLAIN.ahead(larger, empty) > 400 and limited.ahead(larger, empty) < 6.0
    assert not limited.supports(empty, larger, 8.0)


@pytest.mark.parametrize(
    ('times', 'nats'), [(0.5, 0.0), (1.0, 0.0), (1.2, 0.0), (3.0, np.log(3.0))]
)
def test_nothing_is_unexplained_where_the_residual_is_noise(times, nats):
    """40 samples three times the noise in 40 windows save the logarithm of three each."""
    left = scored([], np.full(40, 20.0 * times**2), FOLD)
    assert PLAIN.unexplained(left) == pytest.approx(40 * 40 * nats, rel=0.05)


@pytest.mark.parametrize(('times', 'noise'), [(1.0, True), (1.1, True), (1.5, False)])
def test_a_set_leaves_no_more_than_noise_or_does(times, noise):
    """Some windows of white noise seem to hold more than noise; so many are expected."""
    residual = times * np.random.default_rng(3).standard_normal((40, 40))
    left = scored([], np.ones(40), FOLD)
    left = replace(left, at=left.at._replace(fit=replace(left.fit, residual=residual)))
    left = replace(left, left=0.5 * (residual**2).sum(axis=1))
    assert PLAIN.leaves_noise(left, 12.0) == noise


def test_what_saves_a_trifle_of_what_nothing_explains_is_not_supported():
    empty = scored([], np.full(40, 200.0), FOLD)
    larger = scored(['armature'], np.full(40, 199.0), FOLD)
    assert PLAIN.negligible(larger) > 60.0 and not PLAIN.supports(empty, larger, 8.0)
    best = scored(['armature'], np.full(40, 190.0), FOLD)
    assert PLAIN.supports(empty, best, 8.0)


def test_most_is_explained_where_most_windows_say_so():
    """Of forty samples in a window noise leaves 20 nats."""
    noise, off, wild = np.full(40, 20.0), np.full(40, 100.0), np.full(40, 100.0)
    wild[:2] = 4000.0
    before, after, calmer = (scored([], left, FOLD) for left in (off, noise, wild))
    assert PLAIN.explains_most(before, after)
    assert not PLAIN.explains_most(calmer, before)
    assert not PLAIN.explains_most(before, before)
