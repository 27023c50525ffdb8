# SPDX-License-Identifier: Apache-2.0
"""A robot with three joints in space, two of them actuated, and effects at some of them."""

import numpy as np
import pytest
from tests.models import modelled, stepped
from tests.robots import ARM

from leo_msgs_py.errors import UserError
from leo_sim.description.robot import load_robot
from leo_sim.effects import place
from leo_sim.model import Model
from leo_sim.model.batch import rollout

EFFECTS = {
    'nothing': [],
    'subsets': [
        ('voltage_scale', 'yaw', {'k': 0.8}),
        ('torque_scale', 'wrist', {'k': 1.2}),
        ('viscous_friction', 'slide', {'b': 2.0}),
        ('link_mass', 'hand', {'m': 0.1}),
        ('command_delay', 'wrist', {'delay': 0.007}),
        ('encoder_offset', 'wrist', {'o': 0.1}),
    ],
    'dry friction everywhere': [
        ('coulomb_friction', 'all', {'c': 0.05}),
        ('load_dependent_friction', 'yaw', {'mu': 0.02}),
    ],
    'play in one gear, friction in all': [
        ('backlash', 'wrist', {'gap': 0.05}),
        ('coulomb_friction', 'all', {'c': 0.02}),
    ],
    'play in both gears': [('backlash', 'all', {'gap': 0.03}), ('armature', 'yaw', {'J': 0.002})],
    'out of the plane': [
        ('external_force', 'upper', {'y': -0.7}),
        ('link_com', 'hand', {'x': 0.01, 'y': 0.02, 'z': -0.01}),
    ],
    'forces': [
        ('external_force', 'hand', {'x': 0.5, 'z': 1.0}),
        ('external_force', 'upper', {'x': -0.2, 'z': 0.3}),
        ('load_dependent_friction', 'wrist', {'mu': 0.05}),
    ],
}


@pytest.fixture
def robot():
    return ARM


@pytest.mark.parametrize('name', EFFECTS)
def test_pybullet_and_batched_rollouts_agree(robot, name):
    model = modelled(robot, *EFFECTS[name])
    rng = np.random.default_rng(0)
    inputs = rng.uniform(-8, 8, (20, 2))
    enabled = rng.uniform(size=(20, 2)) > 0.2
    state = model.state_from([0.3, 0.01, -0.4], [1.0, 0.1, -2.0])
    angles, rates = stepped(model, inputs, 0.02, state, enabled)
    q, dq = rollout(model, angles[:1], rates[:1], inputs[None], 0.02, enabled[None])
    assert q[0] == pytest.approx(angles, abs=1e-8)
    assert dq[0] == pytest.approx(rates, abs=1e-6)
    assert q[0, :, 1].max() <= 0.08 + 1e-3
    assert q[0, :, 1].min() >= -0.05 - 1e-3


def test_inputs_reach_the_actuators_in_their_order(robot):
    model = Model(robot, constants={'gravity': 0.0}, engine='rigid')
    rest = model.start()
    wrist, yaw = (model.step(rest, u, 1e-4).dq for u in ([1.0, 0.0], [0.0, 1.0]))
    assert abs(wrist[2]) > 3 * abs(wrist[0])
    assert abs(yaw[0]) > abs(wrist[0])


def test_scans_keep_their_leading_axis(robot):
    b = np.array([0.0, 0.01, 0.02])[:, None, None]
    scan = place(robot, 'viscous_friction', ['yaw', 'wrist'], b=b)
    start = np.zeros((2, 3))
    q, _ = rollout(Model(robot, [scan]), start, start + 1.0, np.ones((2, 4, 2)), 0.02)
    assert q.shape == (3, 2, 5, 3)
    single = place(robot, 'viscous_friction', ['yaw', 'wrist'], b=0.02)
    one, _ = rollout(Model(robot, [single]), start, start + 1.0, np.ones((2, 4, 2)), 0.02)
    assert q[2] == pytest.approx(one, abs=1e-10)


def test_what_no_hinge_shows_is_no_parameter(robot):
    """A centre of mass along the one axis that turns its link, a force along it, do nothing."""
    leo, so101, bob = map(load_robot, ('leo', 'so101', 'pendulum'))
    for name in ('link_com', 'external_force'):
        for arm, link in ((robot, 'upper'), (so101, 'shoulder_link')):
            assert (*place(arm, name, link).parameters,) == ('x', 'y', 'z')
        assert (*place(leo, name, 'torso').parameters,) == ('x', 'z')
    with pytest.raises(UserError, match='link_com has no parameter'):
        place(bob, 'link_com', 'bob', y=0.1)
