# SPDX-License-Identifier: Apache-2.0
"""Units of constants: what slides has those of sliding, and files of before may say the others."""

import pytest
from tests.robots import CART, like

from leo_msgs_py.errors import UserError
from leo_sim.description.robot import load_robot
from leo_sim.model.model_file import load_model


@pytest.mark.parametrize('unit', ['N', 'N m'])
def test_the_limit_of_a_slide_is_a_force_and_of_what_turns_a_torque(tmp_path, unit):
    robot = like(CART, tmp_path, ('unit: N m}}}', f'unit: {unit}}}}}}}'))
    units = {path: c.unit for path, c in robot.constants.items()}
    assert units['actuators.rail.limit'] == 'N' and units['joints.rail.damping'] == 'N s/m'
    assert units['actuators.rail.rotor_inertia'] == 'kg' and units['links.cart.mass'] == 'kg'
    hinge = load_robot('torque_pendulum').constants
    assert hinge['joints.pivot.damping'].unit == 'N m s/rad'
    assert hinge['actuators.pivot.limit'].unit == 'N m'


@pytest.mark.parametrize('unit', ['N s/m', 'N m s/rad'])
def test_a_model_file_may_give_the_damping_of_a_slide_in_either(tmp_path, unit):
    path = tmp_path / 'model.yaml'
    path.write_text(
        f'robot: {CART.folder}\nconstants:\n  joints.rail.damping: {{value: 0.5, unit: {unit}}}\n'
    )
    constant = load_model(path).robot.constants['joints.rail.damping']
    assert (constant.value, constant.unit) == (0.5, 'N s/m')


@pytest.mark.parametrize('unit', ['V', 'kg', 'rad'])
def test_another_unit_is_refused(tmp_path, unit):
    with pytest.raises(UserError, match="the unit is 'N', found"):
        like(CART, tmp_path, ('unit: N m}}}', f'unit: {unit}}}}}}}'))
