# SPDX-License-Identifier: Apache-2.0
"""A motor with a flywheel, whose centre of mass lies on the axis."""

from pathlib import Path

from tests.robots import made

from leo_sim.description.robot import Robot

URDF = """
<robot name="flywheel"><link name="frame"/>
<link name="wheel"><inertial><mass value="0.5"/>
<inertia ixx="2e-4" iyy="4e-4" izz="2e-4" ixy="0" ixz="0" iyz="0"/></inertial></link>
<joint name="shaft" type="continuous"><parent link="frame"/><child link="wheel"/>
<axis xyz="0 1 0"/></joint></robot>
"""
MOTOR = """
  shaft: {limit: {value: 12, unit: V}, supply: {value: 12, unit: V},
          torque_constant: {value: 0.04, unit: N m/A}, resistance: {value: 1.5, unit: ohm}}
"""


def flywheel(folder: Path, motor: bool = True, gravity: float = 9.81) -> Robot:
    """The robot, made in an empty folder; without a motor it runs down."""
    figures = (
        f'name: flywheel\ninput: {"voltage" if motor else "torque"}\ncontrol_period: 0.01\n'
        'integration_step: 0.01\nstate_rate: 100\nepisode_seconds: 20\n'
        f'gravity: {{value: {gravity}, unit: m/s2}}\nactuators: {MOTOR if motor else "{}"}\n'
        'start_poses: {nominal: {}}\n'
    )
    return made(folder, URDF, figures)
