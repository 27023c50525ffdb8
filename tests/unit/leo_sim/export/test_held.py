# SPDX-License-Identifier: Apache-2.0
"""What of a model each format holds, and what is said of the rest."""

import pytest

from leo_sim.effects import place
from leo_sim.export.formats import urdf
from leo_sim.export.held import held
from leo_sim.model import Model

IN_BOTH = {'viscous_friction': {'b': 0.1}, 'coulomb_friction': {'c': 0.1}, 'link_mass': {'m': 0.1}}
IN_MJCF = {
    'joint_spring': {'k': 1.0, 'rest': 0.2},
    'bias_torque': {'t': 0.1},
    'armature': {'J': 0.1},
    'back_emf_scale': {'k': 2.0},
    'voltage_limit': {'v': 2.0},
    'actuator_lag': {'tau': 0.1},
    'encoder_offset': {'o': 0.1},
}
IN_NONE = {
    'quadratic_drag': {'d': 0.1},
    'torque_ripple': {'a': 0.1, 'n': 3.0},
    'load_dependent_friction': {'mu': 0.1},
    'backlash': {'gap': 0.1},
    'stribeck_load_friction': {'mu': 0.1, 'mu_static': 0.2, 'v_s': 0.1},
    'quadratic_load_friction': {'mu': 0.1, 'mu2': 0.1},
    'directional_load_friction': {'mu': 0.1, 'mu_back': 0.1},
    'voltage_push': {'v': 0.1},
    'command_delay': {'delay': 0.1},
    'voltage_deadband': {'v': 1.0},
    'external_force': {'z': 1.0},
    'encoder_scale': {'k': 1.1},
    'velocity_lag': {'tau': 0.1},
    'measurement_delay': {'delay': 0.1},
}


def sorted_out(name, parameters, format_name, robot='servo_pendulum'):
    model = Model(robot, engine='rigid')
    placed = place(model.robot, name, 'all', **parameters)
    found = held(model.changed(effects=[placed]), format_name)
    of_it = [line for line in found.left_out if line.startswith(f'{name} at ')]
    return [p.effect.name for p in found.model.effects], of_it


@pytest.mark.parametrize('name', [*IN_BOTH, *IN_MJCF])
def test_in_mjcf(name):
    assert sorted_out(name, (IN_BOTH | IN_MJCF)[name], 'MJCF') == ([name], [])


@pytest.mark.parametrize('name', IN_MJCF)
def test_not_in_urdf(name):
    kept, lines = sorted_out(name, IN_MJCF[name], 'URDF')
    assert kept == []
    assert len(lines) == 1
    assert 'URDF holds no ' in lines[0]


@pytest.mark.parametrize('name', IN_NONE)
@pytest.mark.parametrize('format_name', ['MJCF', 'URDF'])
def test_in_none(name, format_name):
    kept, lines = sorted_out(name, IN_NONE[name], format_name)
    assert kept == []
    assert len(lines) == 1


def test_stribeck_friction_keeps_its_level_at_speed():
    values = {'c': 0.1, 'c_static': 0.3, 'v_s': 0.2}
    kept, lines = sorted_out('stribeck_friction', values, 'MJCF')
    assert kept == ['coulomb_friction']
    assert '0.1 N m at speed' in lines[0]


def test_a_constant_torque_needs_a_motor():
    kept, lines = sorted_out('bias_torque', {'t': 0.1}, 'MJCF', 'xl330_pendulum')
    assert kept == []
    assert 'MJCF holds no constant torques' in lines[0]


def test_urdf_has_friction_inertia_and_the_strength_of_the_motor():
    model = Model('servo_pendulum', engine='rigid')
    model = model.changed(
        effects=[place(model.robot, name, 'all', **values) for name, values in IN_BOTH.items()]
    )
    root = urdf(held(model, 'URDF').model)
    joint = root.find('joint')
    assert joint.find('dynamics').attrib == {'damping': '0.1', 'friction': '0.1'}
    assert float(root.find("link[@name='weight']/inertial/mass").get('value')) == pytest.approx(
        0.59
    )
    assert root.find("link[@name='base']/inertial") is None
    assert float(joint.find('limit').get('effort')) == pytest.approx(0.354 * 7.4 / 3.4)
    assert float(joint.find('limit').get('velocity')) == pytest.approx(7.4 / 0.354)


def test_what_a_robot_has_beside_its_effects_is_said():
    lines = '\n'.join(held(Model('servo_pendulum'), 'URDF').left_out)
    assert 'rotor inertia of pivot, 0.0018 kg m2' in lines
    assert 'motor of pivot, 0.354 N m/A and 3.4 ohm' in lines
    assert "a servo's counts of pivot" in '\n'.join(held(Model('xl330_pendulum'), 'MJCF').left_out)
    assert 'stiffness and damping of the ground' in '\n'.join(held(Model('leo'), 'MJCF').left_out)
