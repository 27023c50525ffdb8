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
MODEL = Model(ROBOT)
POOL = {c.label: c for c in candidates(MODEL)}
PARTS = 'link_mass:lower', 'link_com:lower'


def told(*hidden, parts=PARTS):
    """The effects of a fit of the parts, once merged."""
    posed = pose([record(ROBOT, *hidden, seconds=20.0)], [], MODEL, SETTINGS)
    fitted = fit(posed.problem, Hypothesis(tuple(POOL[p] for p in parts)))
    return merged(posed.problem, fitted, POOL.values())


def test_a_payload_is_one_cause():
    found = told(place(ROBOT, 'payload', 'lower', m=0.15, x=0.05, z=-0.1))
    assert [c.label for c in found.hypothesis.candidates] == ['payload:lower']
    assert found.theta[:3] == pytest.approx([0.15, 0.05, -0.1], abs=0.01)


def test_a_link_whose_own_figures_are_wrong_holds_no_payload():
    mass, com = (
        place(ROBOT, 'link_mass', 'lower', m=0.15),
        place(ROBOT, 'link_com', 'lower', x=0.05, z=-0.1),
    )
    found = told(mass, com)
    assert [c.label for c in found.hypothesis.candidates] == [*PARTS]


def test_a_mass_alone_is_none():
    found = told(place(ROBOT, 'link_mass', 'lower', m=0.15), parts=PARTS[:1])
    assert [c.label for c in found.hypothesis.candidates] == [*PARTS[:1]]
