# SPDX-License-Identifier: Apache-2.0
"""The file for Isaac Lab, run against classes with the fields of Isaac Lab 2.3."""

from dataclasses import make_dataclass
import importlib.util
from pathlib import Path
import sys
from types import ModuleType, SimpleNamespace

import numpy as np
import pytest
from tests.hostile_names import folder_of, RUNS
from tests.models import modelled

from leo_msgs_py.errors import UserError
from leo_sim.export.files import export
from leo_sim.export.formats import FORMATS
from leo_sim.model import Model

BASE = (
    *('joint_names_expr', 'effort_limit', 'velocity_limit', 'effort_limit_sim'),
    *('velocity_limit_sim', 'stiffness', 'damping', 'armature', 'friction'),
    *('dynamic_friction', 'viscous_friction'),
)
"""Of `ActuatorBaseCfg`, as isaaclab/actuators/actuator_base_cfg.py of 2.3 has them."""


def config(name, *fields):
    made = make_dataclass(name, [(field, object, None) for field in fields], kw_only=True)
    made.__module__ = __name__
    return made


IMPLICIT, IDEAL = config('ImplicitActuatorCfg', *BASE), config('IdealPDActuatorCfg', *BASE)
MOTOR = config('DCMotorCfg', *BASE, 'saturation_effort')
ARTICULATION = config('ArticulationCfg', 'prim_path', 'spawn', 'init_state', 'actuators')
ARTICULATION.InitialStateCfg = config('InitialStateCfg', 'pos', 'rot', 'joint_pos', 'joint_vel')
URDF = config('UrdfFileCfg', 'asset_path', 'fix_base', 'merge_fixed_joints', 'joint_drive')
CONVERTER = SimpleNamespace(JointDriveCfg=config('JointDriveCfg', 'target_type', 'gains'))
CONVERTER.JointDriveCfg.PDGainsCfg = config('PDGainsCfg', 'stiffness', 'damping')


def module(name, **parts):
    made = ModuleType(name)
    vars(made).update(parts)
    return made


@pytest.fixture
def isaac(monkeypatch):
    sim = module('isaaclab.sim', UrdfFileCfg=URDF, UrdfConverterCfg=CONVERTER)
    there = {
        'isaaclab': module('isaaclab', sim=sim),
        'isaaclab.sim': sim,
        'isaaclab.assets': module('isaaclab.assets', ArticulationCfg=ARTICULATION),
        'isaaclab.actuators': module(
            'isaaclab.actuators',
            ImplicitActuatorCfg=IMPLICIT,
            IdealPDActuatorCfg=IDEAL,
            DCMotorCfg=MOTOR,
        ),
    }
    for name, made in there.items():
        monkeypatch.setitem(sys.modules, name, made)


def loaded(folder: Path, robot: str, *effects, ref: str = 'here'):
    model = modelled(robot, *effects, engine='rigid')
    for path, text in export(model, ref, FORMATS['isaaclab'], folder / 'arm.py').texts.items():
        path.write_text(text, encoding='utf-8')
    spec = importlib.util.spec_from_file_location('exported_arm', folder / 'arm.py')
    found = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(found)
    return found


def test_a_motor_on_volts_is_a_dc_motor(isaac, tmp_path):
    dry, armature = ('coulomb_friction', {'c': 0.02}), ('armature', {'J': 0.001})
    made = loaded(tmp_path, 'servo_pendulum', dry, armature, ('viscous_friction', {'b': 0.01}))
    actuator = made.ROBOT_CFG.actuators['pivot']
    assert isinstance(actuator, MOTOR) and actuator.joint_names_expr == ['pivot']
    assert (actuator.friction, actuator.dynamic_friction) == (0.02, 0.02)
    assert actuator.viscous_friction == pytest.approx(0.01)
    assert actuator.armature == pytest.approx(0.0018 + 0.001)
    assert actuator.velocity_limit == pytest.approx(7.4 / 0.354)
    gain = made.EFFORT_PER_VOLT['pivot']
    assert gain == pytest.approx(0.354 / 3.4)
    assert actuator.saturation_effort == pytest.approx(7.4 * gain)


def dc_motor(cfg, effort, rate):
    effort = effort - cfg.damping * rate
    high = cfg.saturation_effort * (1 - rate / cfg.velocity_limit)
    low = cfg.saturation_effort * (-1 - rate / cfg.velocity_limit)
    return np.clip(effort, max(low, -cfg.effort_limit), min(high, cfg.effort_limit))


@pytest.mark.parametrize('volts', [-7.4, -2.0, 7.4])
@pytest.mark.parametrize('rate', [-20.0, 3.0, 20.0])
def test_it_has_the_torque_of_the_model(isaac, tmp_path, volts, rate):
    made = loaded(tmp_path, 'servo_pendulum', ('back_emf_scale', {'k': 1.3}))
    cfg = made.ROBOT_CFG.actuators['pivot']
    mine = dc_motor(cfg, volts * made.EFFORT_PER_VOLT['pivot'], rate)
    assert mine == pytest.approx(0.354 / 3.4 * (volts - 1.3 * 0.354 * rate))


def test_a_position_servo_is_a_drive_whose_back_emf_is_friction(isaac, tmp_path):
    made = loaded(tmp_path, 'so101')
    assert list(made.ROBOT_CFG.actuators) == list(Model('so101').robot.joint_names)
    actuator = made.ROBOT_CFG.actuators['elbow_flex']
    assert isinstance(actuator, IMPLICIT)
    stall = 1.1776 * 7.4 / 2.4787
    assert actuator.stiffness == pytest.approx(stall * 2.656)
    assert actuator.effort_limit_sim == pytest.approx(stall)
    assert actuator.damping == 0.0
    assert actuator.viscous_friction == pytest.approx(0.0599 + 1.1776**2 / 2.4787)


def test_torques_go_in_as_they_are_and_the_urdf_lies_beside(isaac, tmp_path):
    made = loaded(tmp_path, 'double_pendulum', ('viscous_friction', {'b': 0.1}))
    assert isinstance(made.ROBOT_CFG.actuators['elbow'], IDEAL)
    assert made.ROBOT_CFG.actuators['elbow'].effort_limit == 6.0
    spawn = made.ROBOT_CFG.spawn
    assert spawn.fix_base and Path(spawn.asset_path) == tmp_path / 'arm.urdf'
    assert '<dynamics' not in (tmp_path / 'arm.urdf').read_text(), 'friction would count twice'
    assert made.ROBOT_CFG.init_state.joint_pos == {'shoulder': 0.0, 'elbow': 0.0}


@pytest.mark.parametrize('ref', ['a\nimport os\n', 'x # coding: utf-7', 'a"""\nraise 1'])
def test_where_a_model_is_stays_a_remark(isaac, tmp_path, ref):
    made = loaded(tmp_path, 'torque_pendulum', ref=ref)
    lines = (tmp_path / 'arm.py').read_text().splitlines()
    assert not hasattr(made, 'os')
    assert not any('coding' in line for line in lines[:2])


def test_names_that_isaac_sim_renames_are_refused(tmp_path):
    model = Model(str(folder_of(tmp_path / 'robot', RUNS)))
    with pytest.raises(UserError, match='Isaac Sim renames joint'):
        export(model, 'here', FORMATS['isaaclab'], tmp_path / 'arm.py')
