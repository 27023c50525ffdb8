# SPDX-License-Identifier: Apache-2.0
"""One cause in the place of the effects that it has at one link."""

import pytest
from tests.searched import among, searched
from tests.simulate import record

from leo_sim.description.robot import load_robot
from leo_sim.effects import place
from leo_sim.model import Model

ROBOT = load_robot('double_pendulum')
PARTS = 'link_mass', 'link_com', 'link_inertia'


@pytest.fixture
def model(monkeypatch):
    among(monkeypatch, Model(ROBOT), *PARTS, 'payload')
    return Model(ROBOT)


def test_a_payload_is_told_as_one(model):
    load = place(ROBOT, 'payload', 'lower', m=0.15, x=0.05, z=-0.1)
    found = searched([record(ROBOT, load, seconds=20.0)], model)
    (effect,) = found.final.hypothesis.candidates
    assert effect.label == 'payload:lower'
    assert found.final.theta[:3] == pytest.approx([0.15, 0.05, -0.1], abs=0.01)


def test_a_link_that_is_wrong_in_itself_holds_no_payload(model):
    heavy = place(ROBOT, 'link_mass', 'lower', m=0.15)
    found = searched([record(ROBOT, heavy, seconds=20.0)], model)
    assert [c.label for c in found.final.hypothesis.candidates] == ['link_mass:lower']
