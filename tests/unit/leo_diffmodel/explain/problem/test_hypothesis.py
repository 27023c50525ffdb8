# SPDX-License-Identifier: Apache-2.0
"""Bounds and steps that depend on another parameter, as static friction on the sliding one."""

import numpy as np
from tests.searched import among
from tests.simulate import record, TORQUE

from leo_diffmodel.explain.explanation import explain
from leo_diffmodel.explain.problem.candidates import candidates, uncertain
from leo_diffmodel.explain.problem.hypothesis import Hypothesis
from leo_sim.effects import place
from leo_sim.model import Model

BASE = Model(TORQUE)
STRIBECK, DRAG, SPRING = (
    next(c for c in candidates(BASE) if c.effect.name == name)
    for name in ('stribeck_friction', 'quadratic_drag', 'joint_spring')
)
RUBBING = ['stribeck', 'coulomb', 'viscous', 'asymmetric']
BENDING = 'torque_ripple', 'bias_torque', 'external_force', 'link_com', 'encoder_offset'
BOTH = Hypothesis((DRAG, STRIBECK), uncertain(BASE))


def test_static_friction_is_kept_at_or_above_the_sliding_one():
    below, above = np.array([-1.0, 0.2, 0.1, 0.5]), np.array([0.1, 0.2, 0.3, 0.5])
    np.testing.assert_array_equal(BOTH.bounded(below), [0.0, 0.2, 0.2, 0.5])
    np.testing.assert_array_equal(BOTH.bounded(above), above)
    np.testing.assert_array_equal(BOTH.least(below), [0.0, 0.0, 0.2, 0.0])
    for theta in (below, np.stack([below, above])):
        values = BOTH.placed(BASE, theta)[1].parameters
        assert np.all(np.asarray(values['c_static']) >= np.asarray(values['c']))


def test_friction_that_rises_with_speed_is_no_stribeck_friction(monkeypatch):
    among(monkeypatch, BASE, *(f'{law}_friction' for law in RUBBING), 'quadratic_drag')
    effects = [
        place(TORQUE, 'coulomb_friction', 'pivot', c=0.15),
        place(TORQUE, 'quadratic_drag', 'pivot', d=0.02),
    ]
    answer = explain([record(TORQUE, *effects, seconds=15)], BASE)
    assert {e['name'] for e in answer.effects} == {'coulomb_friction', 'quadratic_drag'}
    alone = next(h for h in answer.hypotheses if h['name'] == 'stribeck_friction')
    values = {name: p['value'] for name, p in alone['parameters'].items()}
    assert values['c_static'] >= values['c']


def test_a_step_is_straight_in_the_torque_of_a_spring():
    """As where a spring is half as stiff as it is and rests twice as far."""
    hypothesis, theta, wanted = Hypothesis((DRAG, SPRING)), np.array([0.1, 1.0]), (0.2, 0.5)
    pull, stiffness = wanted[0] * wanted[1] - 0.1, wanted[0] - theta[0]
    step = np.array([0.0, stiffness, (pull - stiffness * theta[1]) / theta[0]])
    theta = np.array([0.3, *theta])
    np.testing.assert_allclose(hypothesis.moved(theta, step), [0.3, *wanted])
    np.testing.assert_allclose(hypothesis.moved(theta, 0.5 * step), [0.3, 0.15, 0.1 / 0.15])
    np.testing.assert_array_equal(hypothesis.moved(theta, [0.0, -1.0, 0.2]), [0.3, 0.0, 1.2])


def test_a_spring_that_rests_far_beyond_the_data_is_no_ripple(monkeypatch):
    among(monkeypatch, BASE, *BENDING, 'joint_spring')
    spring = place(TORQUE, 'joint_spring', 'pivot', k=0.25, rest=4.0)
    answer = explain([record(TORQUE, spring, seconds=15)], BASE)
    assert [e['name'] for e in answer.effects] == ['joint_spring']
    values = {name: p['value'] for name, p in answer.effects[0]['parameters'].items()}
    assert abs(values['k'] / 0.25 - 1) < 0.1 and abs(values['rest'] / 4.0 - 1) < 0.1


def test_a_constant_is_known_by_its_bounds_and_may_lie_inside_the_one_it_met():
    model = Model('xl330_pendulum')
    armature = next(c for c in candidates(model) if c.effect.name == 'armature')
    free = Hypothesis((armature,), uncertain(model))
    half = 0.5 * (free.high - free.low)[1:]
    middle = np.array([0.001, *(free.low[1:] + half)])
    np.testing.assert_allclose(free.prior(middle), [0.0, *3 / half**2])
    assert not free.room(middle).any()
    met = middle.copy()
    met[:3] = free.low[0], free.low[1], free.high[2]
    held, room = free.prior(met), free.room(met)
    assert np.isinf(held[:3]).all() and np.isfinite(held[3:]).all()
    np.testing.assert_allclose(room[:3], [0.0, 2 * half[0], -2 * half[1]])
    assert not room[3:].any()
