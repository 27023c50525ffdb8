# SPDX-License-Identifier: Apache-2.0
"""Bounds that depend on another parameter: static friction is never below the sliding one."""

import numpy as np
from tests.simulate import record, TORQUE

from leo_diffmodel.explain.candidates import candidates
from leo_diffmodel.explain.engine import uncertain
from leo_diffmodel.explain.explanation import explain
from leo_diffmodel.explain.hypothesis import Hypothesis
from leo_sim.effects import place
from leo_sim.model import Model

BASE = Model(TORQUE)
STRIBECK = next(c for c in candidates(BASE) if c.effect.name == 'stribeck_friction')
DRAG = next(c for c in candidates(BASE) if c.effect.name == 'quadratic_drag')
BOTH = Hypothesis((DRAG, STRIBECK), uncertain(BASE))


def test_static_friction_is_kept_at_or_above_the_sliding_one():
    below, above = np.array([-1.0, 0.2, 0.1, 0.5]), np.array([0.1, 0.2, 0.3, 0.5])
    np.testing.assert_array_equal(BOTH.bounded(below), [0.0, 0.2, 0.2, 0.5])
    np.testing.assert_array_equal(BOTH.bounded(above), above)
    np.testing.assert_array_equal(BOTH.least(below), [0.0, 0.0, 0.2, 0.0])
    for theta in (below, np.stack([below, above])):
        values = BOTH.placed(BASE, theta)[1].parameters
        assert np.all(np.asarray(values['c_static']) >= np.asarray(values['c']))


def test_friction_that_rises_with_speed_is_no_stribeck_friction():
    effects = [place(TORQUE, 'coulomb_friction', 'pivot', c=0.15),
               place(TORQUE, 'quadratic_drag', 'pivot', d=0.02)]
    answer = explain([record(TORQUE, *effects, seconds=15)], BASE)
    assert {e['name'] for e in answer.effects} == {'coulomb_friction', 'quadratic_drag'}
    alone = next(h for h in answer.hypotheses if h['name'] == 'stribeck_friction')
    values = {name: p['value'] for name, p in alone['parameters'].items()}
    assert values['c_static'] >= values['c']
