# SPDX-License-Identifier: Apache-2.0
"""What of a model each format holds, and what is said of the rest."""

from dataclasses import replace

import numpy as np
import pytest
from tests.models import modelled
from tests.robots import SLIDES

from leo_sim.effects import place
from leo_sim.export import needs
from leo_sim.export.files import TREES
from leo_sim.export.held import held
from leo_sim.export.urdf import urdf
from leo_sim.model import Model
from leo_sim.references.mjcf import written
from leo_sim.verbs.skeleton.folder import make_folder

ROTOR = 'actuators.left.rotor_inertia'
IN_BOTH = {'viscous_friction': {'b': 0.1}, 'coulomb_friction': {'c': 0.1}, 'link_mass': {'m': 0.1}}
IN_MJCF = {
    'joint_spring': {'k': 1.0, 'rest': 0.2},
    'bias_torque': {'t': 0.1},
    'armature': {'J': 0.1},
    'back_emf_scale': {'k': 2.0},
    'voltage_limit': {'v': 2.0},
    'actuator_lag': {'tau': 0.1},
    'encoder_offset': {'o': 0.1},
    'quadratic_drag': {'d': 0.1},
    'command_delay': {'delay': 0.1},
    'measurement_delay': {'delay': 0.1},
}
IN_FORMAT = {
    'MJCF': (*IN_MJCF,),
    'URDF': (),
    'SDF': ('joint_spring', 'back_emf_scale', 'voltage_limit'),
    'Isaac Lab': ('armature', 'back_emf_scale', 'voltage_limit'),
}
"""What of that each format holds."""
SHOWN = {
    needs.INERTIA: ('link_mass', 'body_mass'),
    needs.ARMATURE: ('armature', 'dof_armature'),
    needs.DAMPING: ('viscous_friction', 'dof_damping'),
    needs.DRAG: ('quadratic_drag', 'dof_dampingpoly'),
    needs.SPRING: ('joint_spring', 'jnt_stiffness'),
    needs.DRY: ('coulomb_friction', 'dof_frictionloss'),
    needs.BIAS: ('bias_torque', 'actuator_biasprm'),
    needs.MOTOR: ('back_emf_scale', 'actuator_biasprm'),
    needs.LIMIT: ('voltage_limit', 'actuator_ctrlrange'),
    needs.LAG: ('actuator_lag', 'actuator_dynprm'),
    needs.DELAY: ('command_delay', 'actuator_delay'),
    needs.RAMP: ('goal_rate', 'actuator_dynprm'),
    needs.OFFSET: ('encoder_offset', 'qpos0'),
    needs.LATE: ('measurement_delay', 'sensor_delay'),
    needs.TOUCH: ('ground_friction', 'pair_friction'),
}
"""By what is held an effect that needs it, and where MuJoCo has that."""
IN_NONE = {
    'torque_ripple': {'a': 0.1, 'n': 3.0},
    'load_dependent_friction': {'mu': 0.1},
    'backlash': {'gap': 0.1},
    'supply_sag': {'R': 0.1},
    'stribeck_load_friction': {'mu': 0.1, 'mu_static': 0.2, 'v_s': 0.1},
    'quadratic_load_friction': {'mu': 0.1, 'mu2': 0.1},
    'directional_load_friction': {'mu': 0.1, 'mu_back': 0.1},
    'voltage_push': {'v': 0.1},
    'voltage_deadband': {'v': 1.0},
    'external_force': {'z': 1.0},
    'late_payload': {'m': 0.1},
    'encoder_scale': {'k': 1.1},
    'encoder_eccentricity': {'a': 0.1},
    'warming_friction': {'c': 0.1, 'c_start': 0.2},
    'torque_fade': {'s': 0.1},
    'velocity_lag': {'tau': 0.1},
}


def sorted_out(name, parameters, format_name, robot='servo_pendulum'):
    found = held(modelled(robot, (name, parameters), engine='rigid'), format_name)
    of_it = [line for line in found.left_out if line.startswith(f'{name} at ')]
    return [p.effect.name for p in found.model.effects], of_it


@pytest.mark.parametrize('format_name', IN_FORMAT)
@pytest.mark.parametrize('name', [*IN_BOTH, *IN_MJCF, *IN_NONE])
def test_in_a_format(name, format_name):
    kept, lines = sorted_out(name, (IN_BOTH | IN_MJCF | IN_NONE)[name], format_name)
    if name in IN_BOTH or name in IN_FORMAT[format_name]:
        assert (kept, lines) == ([name], [])
    else:
        assert kept == []
        assert len(lines) == 1 and f'{format_name} holds no ' in lines[0]


@pytest.mark.parametrize(
    ('format_name', 'need'),
    [(name, need) for name in ('MJCF', 'URDF') for need in sorted(needs.SPEAKS[name])],
)
def test_mujocos_compiler_takes_what_the_table_says(format_name, need):
    mujoco = pytest.importorskip('mujoco')
    name, figure = SHOWN[need]
    robot = {'goal_rate': 'xl330_pendulum', 'ground_friction': 'leo'}.get(name, 'servo_pendulum')
    values = (IN_BOTH | IN_MJCF | {'goal_rate': {'rate': 2.0}, 'ground_friction': {'mu': 0.3}})[
        name
    ]
    model = modelled(robot, (name, values))
    assert need in needs.needs(model.effects[0], model.robot)
    without, taken = (
        getattr(mujoco.MjModel.from_xml_string(text), figure)
        for held_ in (held(Model(robot), format_name), held(model, format_name))
        for text in [written(TREES[format_name](held_.model))]
    )
    assert not np.array_equal(without, taken)


@pytest.mark.parametrize(
    ('name', 'shape'),
    [('stribeck_friction', {'c_static': 0.3, 'v_s': 0.2}), ('smooth_friction', {'v_0': 0.3})],
)
def test_friction_keeps_its_level_at_speed(name, shape):
    kept, lines = sorted_out(name, {'c': 0.1, **shape}, 'MJCF')
    assert kept == ['coulomb_friction']
    assert '0.1 N m at speed' in lines[0]


def test_figures_of_a_slide_are_in_its_units(tmp_path):
    (tmp_path / 'g.urdf').write_text(SLIDES)
    robot = make_folder(tmp_path / 'g.urdf', tmp_path / 'g', 'voltage').robot
    robot = robot.with_constants({ROTOR: replace(robot.constants[ROTOR], value=0.2)})
    stribeck = place(robot, 'stribeck_friction', 'left', c=0.1, c_static=0.3, v_s=0.2)
    said = '\n'.join(held(Model(robot, effects=[stribeck]), 'URDF').left_out)
    assert 'holds the 0.1 N at speed' in said
    assert 'rotor inertia of left, 0.2 kg:' in said and ' N/A and ' in said


def test_a_constant_torque_needs_a_motor():
    kept, lines = sorted_out('bias_torque', {'t': 0.1}, 'MJCF', 'xl330_pendulum')
    assert kept == []
    assert 'MJCF holds no constant torques' in lines[0]


def test_urdf_has_friction_inertia_and_the_strength_of_the_motor():
    root = urdf(held(modelled('servo_pendulum', *IN_BOTH.items(), engine='rigid'), 'URDF').model)
    joint = root.find('joint')
    assert joint.find('dynamics').attrib == {'damping': '0.1', 'friction': '0.1'}
    mass = root.find("link[@name='weight']/inertial/mass")
    assert float(mass.get('value')) == pytest.approx(0.59)
    assert root.find("link[@name='base']/inertial") is None
    assert float(joint.find('limit').get('effort')) == pytest.approx(0.354 * 7.4 / 3.4)
    assert float(joint.find('limit').get('velocity')) == pytest.approx(7.4 / 0.354)


def test_what_a_robot_has_beside_its_effects_is_said():
    lines = '\n'.join(held(Model('servo_pendulum'), 'URDF').left_out)
    assert 'rotor inertia of pivot, 0.0018 kg m2' in lines
    assert 'motor of pivot, 0.354 N m/A and 3.4 ohm' in lines
    assert "a servo's counts of pivot" in '\n'.join(held(Model('xl330_pendulum'), 'MJCF').left_out)
    assert 'stiffness and damping of the ground' in '\n'.join(held(Model('leo'), 'MJCF').left_out)


def test_what_a_format_holds_is_simulated_without_the_rest():
    whole = Model('servo_pendulum', engine='rigid')
    offset = place(whole.robot, 'encoder_offset', 'pivot', o=0.3)
    drives = {}
    for format_name in needs.SPEAKS:
        model = held(whole.changed(effects=[offset]), format_name).simulated
        laws, one = model.laws, np.ones(1)
        slowed = laws.torques(one, 0 * one, 0 * one, one, None, None).motor
        slowed = slowed - laws.torques(one, one, one, one, None, None).motor
        inertia, gravity = float(laws.rotor_inertia[0]), float(model.constants['gravity'])
        drives[format_name] = inertia > 0, slowed[0] > 0, gravity, len(model.effects)
    assert drives == {
        'MJCF': (True, True, 9.81, 1),
        'URDF': (False, False, 9.81, 1),  # the one that takes the back-EMF off
        'SDF': (False, True, 9.8, 0),
        'Isaac Lab': (True, True, 9.81, 0),
    }


def test_friction_of_a_robot_and_of_an_effect_is_one_level():
    model = modelled('so101', ('coulomb_friction', {'c': 0.05}), engine='rigid')
    for rate in (-1.0, 0.0, 1.0):
        still, moving = np.zeros(6), np.full(6, rate)
        level = model.laws.torques(still, moving, moving, still, None, None).level
        np.testing.assert_allclose(level, 0.0515 + 0.05)


def test_gains_of_servos_are_in_every_format_with_motors_and_limited_goals_in_mjcf():
    for name, values in {'servo_stiffness': {'k': 2.0}, 'servo_damping': {'d': 0.1}}.items():
        for format_name in needs.SPEAKS:
            kept, lines = sorted_out(name, values, format_name, 'xl330_pendulum')
            assert bool(kept) == (format_name != 'URDF') and bool(kept) != bool(lines)
    _, lines = sorted_out('goal_rate', {'rate': 2.0}, 'SDF', 'xl330_pendulum')
    _, gentle = sorted_out('goal_acceleration', {'a': 20.0}, 'MJCF', 'xl330_pendulum')
    assert 'SDF holds no limited rates of goals' in lines[0]
    assert 'MJCF holds no limited accelerations of goals' in gentle[0]
    both = ('goal_rate', {'rate': 2.0}), ('actuator_lag', {'tau': 0.1})
    found = held(modelled('xl330_pendulum', *both), 'MJCF')
    assert [p.effect.name for p in found.model.effects] == ['goal_rate']
    assert any('actuator_lag' in line and 'no second lag' in line for line in found.left_out)
