# SPDX-License-Identifier: Apache-2.0
"""One cause in the place of the effects that it has at one link."""

import pytest
from tests.simulate import record

from leo_diffmodel.explain.estimate.fit import fit
from leo_diffmodel.explain.estimate.merged import merged
from leo_diffmodel.explain.problem.candidates import candidates
from leo_diffmodel.explain.problem.hypothesis import Hypothesis
from leo_diffmodel.explain.problem.pose import pose
from leo_diffmodel.explain.settings import SETTINGS
from leo_sim.description.robot import load_robot
from leo_sim.effects import place
from leo_sim.model import Model

ROBOT = load_robot('double_pendulum')
PARTS = 'link_mass', 'link_com'


def told(robot, link, *hidden, parts=PARTS):
    """Effects of a fit of the parts at a link, once merged, and its values."""
    model = Model(robot)
    pool = {c.label: c for c in candidates(model)}
    problem = pose([record(robot, *hidden, seconds=20.0)], [], model, SETTINGS).problem
    fitted = fit(problem, Hypothesis(tuple(pool[f'{part}:{link}'] for part in parts)))
    found = merged(problem, fitted, pool.values())
    return [c.effect.name for c in found.hypothesis.candidates], found.theta


def test_a_payload_is_one_cause():
    names, values = told(ROBOT, 'lower', place(ROBOT, 'payload', 'lower', m=0.15, x=0.05, z=-0.1))
    assert names == ['payload'] and values[:3] == pytest.approx([0.15, 0.05, -0.1], abs=0.01)


def test_a_link_whose_own_figures_are_wrong_holds_no_payload():
    mass = place(ROBOT, 'link_mass', 'lower', m=0.15)
    com = place(ROBOT, 'link_com', 'lower', x=0.05, z=-0.1)
    assert told(ROBOT, 'lower', mass, com)[0] == [*PARTS]


def test_a_mass_alone_is_none():
    mass = place(ROBOT, 'link_mass', 'lower', m=0.15)
    assert told(ROBOT, 'lower', mass, parts=PARTS[:1])[0] == [*PARTS[:1]]


def test_on_a_single_hinge_it_is_no_other_cause():
    robot = load_robot('torque_pendulum')
    assert told(robot, 'bob', place(robot, 'payload', 'bob', m=0.05, x=0.02, z=-0.3))[0] == [
        *PARTS
    ]
