# SPDX-License-Identifier: Apache-2.0
"""All effects at once: what is wrong at every joint is named there, and nothing beside it."""

import time

import numpy as np
import pytest
from tests.searched import searched
from tests.simulate import DT, record

from leo_diffmodel.explain.estimate.background import background
from leo_diffmodel.explain.estimate.choice import choose, Price, rivals
from leo_diffmodel.explain.estimate.fit import fit
from leo_diffmodel.explain.estimate.fitted import linear_part
from leo_diffmodel.explain.estimate.matrices import Matrices, matrices
from leo_diffmodel.explain.estimate.terms import Column, Term
from leo_diffmodel.explain.problem.candidates import candidates, limited
from leo_diffmodel.explain.problem.hypothesis import Candidate, Hypothesis
from leo_diffmodel.explain.problem.pose import pose, shorter
from leo_diffmodel.explain.problem.sizes import scales_of
from leo_diffmodel.explain.select.search import search
from leo_diffmodel.explain.settings import SETTINGS
from leo_sim.description.robot import load_robot
from leo_sim.effects import EFFECTS, place
from leo_sim.model import Model

ROBOT = load_robot('double_pendulum')
NOISE = 5e-4, 0.01
TRUTH = {
    ('viscous_friction', 'shoulder'): {'b': 0.11},
    ('coulomb_friction', 'shoulder'): {'c': 0.35},
    ('viscous_friction', 'elbow'): {'b': 0.06},
    ('coulomb_friction', 'elbow'): {'c': 0.15},
}
LOSSES = [place(ROBOT, name, where, **values) for (name, where), values in TRUTH.items()]


def recorded(*effects, seed=1, seconds=20.0):
    """The double pendulum, driven by sines of several periods."""
    rng, t = np.random.default_rng(seed), DT * np.arange(round(seconds / DT))
    hertz, phase = rng.uniform(0.2, 1.2, (2, 4)), rng.uniform(0, 6.3, (2, 4))
    waves = np.sin(2 * np.pi * hertz * t[:, None, None] + phase).sum(axis=-1)
    return record(ROBOT, *effects, seed=seed, noise=NOISE, inputs=waves * [2.0, 0.8])


def named(found):
    return {(c.effect.name, c.where) for c in found.chosen.names}


@pytest.fixture(scope='module')
def rubbing():
    return searched([recorded(*LOSSES)], Model(ROBOT))


def test_losses_of_every_joint_are_named_with_their_sizes_and_nothing_beside_them(rubbing):
    assert named(rubbing) == {*TRUTH}
    fitted = rubbing.final
    for i, candidate in enumerate(fitted.hypothesis.candidates):
        truth = TRUTH[candidate.effect.name, candidate.where]
        assert fitted.hypothesis.values(fitted.theta, i) == pytest.approx(truth, rel=0.05)
    assert rubbing.leaves_noise and fitted.certificate.converged
    assert np.mean([names == rubbing.chosen.names for names in rubbing.resamples]) >= 0.9


def test_what_is_missing_beside_losses_is_named_too():
    other = place(ROBOT, 'joint_spring', 'elbow', k=1.2, rest=0.3)
    found = searched([recorded(*LOSSES, other, seconds=12.0)], Model(ROBOT))
    assert named(found) == {*TRUTH, ('joint_spring', 'elbow')}


def test_nothing_is_named_where_nothing_is_missing():
    found = searched([recorded(seconds=12.0)], Model(ROBOT))
    assert named(found) == set() and found.complete


def test_every_other_candidate_has_a_scan(rubbing):
    scanned = {s.candidate.label for s in rubbing.scans}
    assert {'joint_spring:elbow', 'backlash:shoulder', 'link_mass:upper'} <= scanned
    assert {'joint_spring:all', 'actuator_lag:all'} <= scanned
    worth = {s.candidate: s.gain for s in rubbing.scans}
    assert max(worth.values()) < 3 * rubbing.threshold


def test_without_time_the_answer_is_not_complete():
    data, model = [recorded(*LOSSES, seconds=8.0)], Model(ROBOT)
    assert not search(data, model, pose(data, [], model), until=time.monotonic()).complete


@pytest.fixture(scope='module')
def linear():
    """A fit of two of four losses in short windows, and its matrices with all four."""
    data, model = [recorded(*LOSSES)], Model(ROBOT)
    problem = shorter(pose(data, [], model), data)
    pool = [limited(c, model, SETTINGS.grids) for c in candidates(model) if c.where != 'all']
    pool = [c for c in pool if c.effect.name in ('viscous_friction', 'coulomb_friction')]
    first = Hypothesis(tuple(c for c in pool if c.where == 'shoulder'))
    fitted = fit(problem, first)
    return problem, fitted, matrices(problem, fitted, scales_of(model, problem.windows), pool)


def test_short_windows_are_those_that_may_be_seen(linear):
    problem, _, _ = linear
    assert problem.train.all()
    assert problem.windows.dt.sum(axis=1).max() < 0.5 * SETTINGS.grids.search_seconds


def test_the_least_of_a_set_lies_within_its_limits_and_below_its_parts(linear):
    _, _, made = linear
    whole, best = made.least(made.terms)
    low, high = made.limits
    assert (best >= low - 1e-6).all() and (best <= high + 1e-6).all()
    for term in made.terms:
        assert made.least([t for t in made.terms if t is not term])[0] >= whole
    assert made.least([])[0] == made.total


def test_gains_are_what_a_set_saves_with_one_more(linear):
    _, _, made = linear
    before = made.least(made.members)[0]
    gains = made.gains(made.members, [[t] for t in made.others])
    for gain, other in zip(gains, made.others, strict=True):
        assert gain == pytest.approx(before - made.least([*made.members, other])[0], rel=0.05)


def test_what_is_missing_is_chosen_and_fits_as_the_linear_answer_says(linear):
    _, _, made = linear
    chosen = choose(made, Price(20.0, 5.0), SETTINGS.changed(wait=0.0).numerics)
    hypothesis, theta = made.hypothesis(chosen)
    assert {(c.effect.name, c.where) for c in hypothesis.candidates} == {*TRUTH}
    for i, c in enumerate(hypothesis.candidates):
        truth = TRUTH[c.effect.name, c.where]
        assert hypothesis.values(theta, i) == pytest.approx(truth, rel=0.5)


def test_what_is_kept_is_in_every_choice(linear):
    problem, _, made = linear
    dear = made, Price(1e9, 0.0), problem.numerics
    assert choose(*dear) == [] and choose(*dear, lambda _: True) == [*made.members]


def test_two_effects_may_be_near_in_the_place_of_one(linear):
    _, _, made = linear
    near = rivals(made, Price(20.0, 5.0), SETTINGS, 15.0)
    assert any(len({*terms} - {*made.members}) == 2 for terms in near)


def test_one_cause_of_what_losses_at_all_joints_do_is_chosen_beside_them():
    """It is credited with what they cost, and stays though it saves less than its own price."""
    losses = [Candidate(EFFECTS['viscous_friction'], f'joint_{i}', ()) for i in range(4)]
    column = Column(np.ones(1), 0.0, np.inf)
    pool = [*losses, Candidate(EFFECTS['voltage_scale'], 'all', ())]
    *each, cause = (Term(c, np.zeros(1), (column,), i) for i, c in enumerate(pool))
    rows = np.vstack([np.eye(5)[:4], [*4 * [0.995**0.5 / 2], 0.005**0.5]])
    target = np.array([*4 * [2.2], 4.5])
    limits = np.array([np.zeros(5), np.full(5, np.inf)])
    data = rows @ rows.T, rows @ target, 0.5 * target @ target, limits, np.ones(5)
    made = Matrices(None, tuple(each), (cause,), *data, (), 8.0, 100, {})
    usual = EFFECTS['viscous_friction']
    chosen = choose(made, Price(8.0, 0.0), SETTINGS.numerics, lambda c: c.effect == usual)
    assert chosen == [*each, cause]


def test_a_part_by_its_linear_answer_is_near_its_fit(rubbing):
    problem, whole = rubbing.problem, rubbing.final
    out = whole.hypothesis.candidates[-1]
    part = linear_part(problem, whole, [out])
    again = fit(problem, part.hypothesis, part.theta, part.start)
    assert out not in part.hypothesis.candidates
    assert part.lost(problem.train) > whole.lost(problem.train)
    assert again.theta == pytest.approx(part.theta, rel=0.5)


def test_small_differences_make_intervals_wider(linear):
    _, fitted, made = linear
    alone = background(made, fitted.hypothesis.candidates, 1.0)
    assert alone.scale > 0
    wider = alone.widened(fitted)
    assert (wider.standard_errors > fitted.standard_errors).all()
    both = [t.candidate for t in made.terms]
    assert background(made, both, 1.0).widened(fitted) is not None


def test_a_payload_is_a_mass_at_a_place_and_its_first_moments():
    load = place(ROBOT, 'payload', 'lower', m=0.02, x=0.03, z=-0.12)
    model = Model(ROBOT)
    posed = pose([recorded(load)], [], model, SETTINGS)
    pool = [c for c in candidates(model) if c.label == 'payload:lower']
    given = fit(posed.problem, Hypothesis())
    linear = matrices(posed.problem, given, scales_of(model, posed.problem.windows), pool)
    best = min(linear.terms, key=lambda t: linear.least([t])[0])
    hypothesis, theta = linear.hypothesis([best])
    assert hypothesis.candidates == tuple(pool)
    assert theta == pytest.approx([0.02, 0.03, -0.12], abs=0.03)


def test_a_payload_beside_losses_at_every_joint_is_told_as_one():
    load = place(ROBOT, 'payload', 'lower', m=0.15, x=0.05, z=-0.1)
    data, held = recorded(load, *LOSSES), recorded(load, *LOSSES, seed=2)
    found = searched([data], Model(ROBOT), hold_out=[held])
    assert named(found) == {*TRUTH, ('payload', 'lower')}
    index = [c.effect.name for c in found.final.hypothesis.candidates].index('payload')
    values = found.final.hypothesis.values(found.final.theta, index)
    assert values == pytest.approx({'m': 0.15, 'x': 0.05, 'z': -0.1}, abs=0.01)
