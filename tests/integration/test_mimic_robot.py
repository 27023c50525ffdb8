# SPDX-License-Identifier: Apache-2.0
"""A gripper whose joints mimic each other, from its URDF to the effect it lacks."""

from pathlib import Path

import numpy as np
import pytest
from tests.robots import CLAW, skeleton_of
from tests.simulate import bag, record

from leo_diffmodel.explain.explanation import explain
from leo_diffmodel.explain.problem.classes import Facts
from leo_msgs_py.cli import main
from leo_sim.effects import place
from leo_sim.model import Model


@pytest.fixture
def claw(tmp_path: Path):
    return skeleton_of(CLAW, tmp_path, left_out=['wheel']).robot


def inputs() -> np.ndarray:
    t = np.arange(0, 8, 0.01)
    return 0.05 * np.sign(np.sin(2.6 * t))[:, None] * (0.4 + 0.6 * np.sin(0.7 * t) ** 2)[:, None]


def test_what_rubs_at_the_leader_is_named(claw):
    friction = place(claw, 'coulomb_friction', 'left', c=0.004)
    data = record(claw, friction, inputs=inputs(), noise=(5e-4, 0.02))
    answer = explain([data], Model(claw))
    assert answer.verdict == 'named'
    (named,) = answer.to_json()['effects']
    assert (named['name'], named['where']) == ('coulomb_friction', 'left')
    assert named['parameters']['c']['value'] == pytest.approx(0.004, rel=0.05)


def test_compare_needs_the_leader_alone(claw, tmp_path, capsys):
    bag(tmp_path / 'bag', record(claw, inputs=inputs(), noise=(5e-4, 0.02)))
    assert main(['compare', str(tmp_path / 'bag'), '--model', str(tmp_path / 'robot')]) == 0
    out = capsys.readouterr().out
    assert 'No place stands out' in out and 'right' not in out


def test_a_link_of_a_joint_that_mimics_is_at_its_leader(claw):
    facts = Facts(claw, ever_free=False)
    assert not facts.alone and not facts.at_base('left')
