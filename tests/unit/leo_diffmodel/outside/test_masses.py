# SPDX-License-Identifier: Apache-2.0
"""What other masses would take of a motion, against robots that have them."""

import numpy as np
import pytest

from leo_diffmodel.outside.masses import Motion
from leo_sim.description.robot import load_robot
from leo_sim.effects import place
from leo_sim.model import Model

ROBOT = load_robot('double_pendulum')


@pytest.fixture(scope='module')
def motion() -> Motion:
    q, dq, ddq = np.random.default_rng(0).uniform(-2, 2, (3, 40, 2))
    return Motion(Model(ROBOT), q, dq, ddq)


def needed(model: Model, motion: Motion) -> np.ndarray:
    mass, bias = model.rigid.mass_and_bias(motion.q, motion.dq)
    return (mass @ motion.ddq[..., None])[..., 0] + bias


def test_a_link_that_weighs_more_is_that_much_of_its_column(motion):
    heavier = {
        path: 1.25 * value
        for path, value in motion.model.constants.items()
        if path.startswith(f'links.{ROBOT.moving_links[1]}.')
        and path.endswith(('.mass', '.inertia'))
    }
    changed = motion.model.changed(constants={**motion.model.constants, **heavier})
    torque, *_ = motion.masses
    saved = needed(changed, motion) - needed(motion.model, motion)
    assert saved == pytest.approx(0.25 * torque[..., 1], abs=1e-9)


def test_a_payload_anywhere_about_a_link_is_a_sum_of_columns(motion):
    """A mass and another centre of mass have the mass, moments and inertia of such points."""
    link = ROBOT.moving_links[1]
    mass, com = place(ROBOT, 'link_mass', link, m=0.4), place(ROBOT, 'link_com', link, z=-0.03)
    carried = motion.model.changed(effects=(mass, com))
    torque, *_ = motion.masses
    own = torque[:, :, [1, *range(8, 14)]].reshape(-1, 7)
    saved = (needed(carried, motion) - needed(motion.model, motion)).ravel()
    left = saved - own @ np.linalg.lstsq(own, saved, rcond=1e-9)[0]
    assert np.abs(left).max() < 1e-6 * np.abs(saved).max()


def test_no_mass_carries_the_weight_of_its_link(motion):
    still = Motion(motion.model, motion.q, 0 * motion.dq, 0 * motion.ddq)
    torque, least, most = still.masses
    load = motion.model.rigid.load(motion.q)[:, 1]
    unlimited = torque[:, 1, np.isinf(most)]
    assert unlimited.shape[-1] == 12 and (unlimited.T @ load <= 1e-9).all()
    assert (least[np.isinf(most)] == 0).all()


def test_a_joint_that_is_turned_on_changes_the_torque_by_its_slope(motion):
    ahead = Motion(motion.model, motion.q + [0.0, 1e-4], motion.dq, motion.ddq)
    slope = (needed(motion.model, ahead) - needed(motion.model, motion)) / 1e-4
    assert motion.turned[..., 1] == pytest.approx(slope, abs=2e-2)
