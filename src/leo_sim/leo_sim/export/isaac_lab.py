# SPDX-License-Identifier: Apache-2.0
"""A model as a Python file for Isaac Lab: an `ArticulationCfg` beside its URDF.

Every word of the program is written here; names of joints, numbers and the URDF's name are put
in as literals.
"""

import math
import re
from typing import Any

from leo_msgs_py.errors import UserError
from leo_sim.description.robot import Robot
from leo_sim.export.figures import Figures, figures, loop_gains, nominal, refuse_mimics, strengths
from leo_sim.model.model import Model

USD_NAME = re.compile(r'[A-Za-z_][A-Za-z0-9_]*')
FASTEST = 1000.0  # rate at which PhysX stops a joint, rad/s or m/s: none is meant
MANY = 10.0
"""Limit of a motor's torque in stalls: its supply limits it, and driven backwards it brakes with
more than a stall."""
PROGRAM = """\
from pathlib import Path

from isaaclab.actuators import DCMotorCfg, IdealPDActuatorCfg, ImplicitActuatorCfg
from isaaclab.assets import ArticulationCfg
import isaaclab.sim as sim_utils

ROBOT_CFG = ArticulationCfg(
    spawn=sim_utils.UrdfFileCfg(
        asset_path=str(Path(__file__).with_name({urdf})),
        fix_base=True,
        joint_drive=sim_utils.UrdfConverterCfg.JointDriveCfg(
            gains=sim_utils.UrdfConverterCfg.JointDriveCfg.PDGainsCfg(stiffness=0.0, damping=0.0)
        ),
    ),
    init_state=ArticulationCfg.InitialStateCfg(joint_pos={start}),
    actuators={{
{actuators}
    }},
)
"""
COMMANDS = """
EFFORT_PER_VOLT = {gains}
\"\"\"Commands are efforts: N m for each V of the robot's own commands, by joint.\"\"\"
"""


def isaac_lab(model: Model, urdf_name: str) -> str:
    """The program, less its first remark; UserError: joints or names that Isaac Sim renames."""
    robot, found = model.robot, figures(model)
    _check(robot)
    actuators = [_actuator(robot, found, i) for i in range(len(robot.joint_names))]
    angles = nominal(robot) or {}
    start = _literal({name: angles.get(name, 0.0) for name in robot.joint_names})
    text = PROGRAM.format(urdf=repr(urdf_name), start=start, actuators='\n'.join(actuators))
    if robot.input == 'voltage':
        drive = found.drives
        gains = (drive.gain * drive.scale).tolist()
        named = zip((a.joint for a in robot.actuators), gains, strict=True)
        text += COMMANDS.format(gains=_literal(dict(named)))
    return text


def _check(robot: Robot) -> None:
    refuse_mimics(robot, 'configuration')
    for name in robot.joint_names:
        if not USD_NAME.fullmatch(name):
            raise UserError(
                f'Isaac Sim renames joint {name!r}; give it a name of letters, '
                'digits and _ in the URDF'
            )


def _actuator(robot: Robot, found: Figures, i: int) -> str:
    """The configuration of one joint; passive joints have one that does nothing."""
    kind, values = ('ImplicitActuatorCfg', {'stiffness': 0.0, 'damping': 0.0})
    viscous = found.damping[i]
    if i in robot.actuated:
        a = robot.actuated.index(i)
        kind, values = _driven(robot, found, a)
        if robot.input == 'position':  # clipped less its back-EMF: that is friction here
            viscous = viscous + found.drives.back_emf[a]
    values |= {
        'velocity_limit_sim': FASTEST,
        'armature': found.armature[i],
        'friction': found.friction[i],
        'dynamic_friction': found.friction[i],
        'viscous_friction': viscous,
    }
    name = robot.joint_names[i]
    lines = [f'{key}={_literal(value)},' for key, value in values.items()]
    inside = '\n            '.join([f'joint_names_expr=[{_literal(name)}],', *lines])
    return f'        {_literal(name)}: {kind}(\n            {inside}\n        ),'


def _driven(robot: Robot, found: Figures, a: int) -> tuple[str, dict[str, Any]]:
    """A motor on volts, torques or goals, as the actuator that has its law."""
    effort, back_emf = strengths(robot, found)[a], found.drives.back_emf[a]
    if robot.input == 'position':
        kp, kv, _ = (gains[a] for gains in loop_gains(found))
        gains = {'stiffness': kp, 'damping': kv}
        return 'ImplicitActuatorCfg', {'effort_limit_sim': effort, **gains}
    gains = {'stiffness': 0.0, 'damping': back_emf}
    if not back_emf:
        return 'IdealPDActuatorCfg', {'effort_limit': effort, **gains}
    return 'DCMotorCfg', {
        'saturation_effort': effort,
        'effort_limit': MANY * effort,
        'velocity_limit': effort / back_emf,
        **gains,
    }


def _literal(value: Any) -> str:
    """A name that `_check` let through, a finite number, or a dictionary of these, as Python."""
    if isinstance(value, dict):
        return f'{{{", ".join(f"{_literal(k)}: {_literal(v)}" for k, v in value.items())}}}'
    if isinstance(value, str):
        return repr(value)
    number = float(value)
    if not math.isfinite(number):
        raise ValueError(f'{number} is no number to write')
    return repr(number)
