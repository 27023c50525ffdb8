# SPDX-License-Identifier: Apache-2.0
"""Joints that mimic others: the compiled tree is the free one, projected on its coordinates."""

from dataclasses import replace

import numpy as np
import pytest
from tests.robots import CLAW

from leo_sim.description.joint import columns
from leo_sim.description.urdf import parse
from leo_sim.dynamics.spatial import Spatial


@pytest.fixture
def tree():
    """The tree, its bodies, and the matrix that gives all its joints' angles."""
    links, joints = parse(CLAW, 'claw.urdf')
    bodies = {link.name: link.body for link in links}
    bodies['tip'] = bodies['tip']._replace(force=(0.3, -0.2, 0.1))
    ratios = np.zeros((len(joints), 2))
    ratios[np.arange(len(joints)), columns(joints)] = [joint.ratio for joint in joints]
    return joints, bodies, ratios


def test_inertia_and_bias_are_those_of_the_free_tree_through_the_jacobian(tree):
    joints, bodies, ratios = tree
    free = Spatial([replace(j, leader='', ratio=1.0) for j in joints], bodies, 9.81)
    rng = np.random.default_rng(1)
    q, dq = rng.uniform(-2, 2, (7, 2)), rng.uniform(-5, 5, (7, 2))
    mass, bias = free.mass_and_bias(q @ ratios.T, dq @ ratios.T)
    own_mass, own_bias = Spatial(joints, bodies, 9.81).mass_and_bias(q, dq)
    assert own_mass == pytest.approx(ratios.T @ mass @ ratios, rel=1e-9, abs=1e-12)
    assert own_bias == pytest.approx(bias @ ratios, rel=1e-9, abs=1e-12)
    assert Spatial(joints, bodies, 9.81).load(q) == pytest.approx(
        free.load(q @ ratios.T) @ ratios, rel=1e-9, abs=1e-12
    )
