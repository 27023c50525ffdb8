# SPDX-License-Identifier: Apache-2.0
"""The search from losses at every joint to what makes them needless."""

import numpy as np
from tests.searched import among, searched
from tests.simulate import DT, record

from leo_sim.description.robot import load_robot
from leo_sim.effects import place
from leo_sim.model import Model

SO101 = load_robot('so101')
LOSSES = ('viscous_friction', 'coulomb_friction')


def goals(seconds: float, seed: int) -> np.ndarray:
    """Sums of slow sines, [rad], shape (N, 6)."""
    t, rng = DT * np.arange(round(seconds / DT))[:, None, None], np.random.default_rng(seed)
    shape = (1, len(SO101.joint_names), 4)
    size, rate, phase = (rng.uniform(*r, shape) for r in ((0.1, 0.35), (0.05, 0.5), (0, 6.28)))
    return np.asarray((size * np.sin(2 * np.pi * rate * t + phase)).sum(axis=-1))


def test_a_weak_supply_and_a_wrong_zero_of_an_arm_are_no_losses_at_its_joints(monkeypatch):
    """A servo arm moves alike with losses and loads times 1 / k, or a supply times k."""
    truth = [
        place(SO101, 'voltage_scale', 'all', k=0.6),
        place(SO101, 'encoder_offset', 'shoulder_lift', o=0.1),
    ]
    among(monkeypatch, Model(SO101), *LOSSES, 'voltage_scale', 'encoder_offset', 'link_mass')
    data = record(SO101, *truth, seconds=8, noise=(4e-4, 0.02), inputs=goals(8, 3))
    found = searched([data], Model(SO101))
    values = {c.label: found.final.own(c)[0] for c in found.final.hypothesis.candidates}
    assert {*values} == {'voltage_scale:all', 'encoder_offset:shoulder_lift'}
    assert abs(values['voltage_scale:all'] - 0.6) < 0.02
    assert abs(values['encoder_offset:shoulder_lift'] - 0.1) < 0.01
