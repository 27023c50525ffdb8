# SPDX-License-Identifier: Apache-2.0
"""A cart that a motor pushes along a level rail: its joint slides; with a pole, one turns."""

from pathlib import Path

from tests.robots import made

from leo_sim.description.robot import Robot

URDF = """
<robot name="cart"><link name="base"/>
<link name="cart"><inertial><mass value="2"/>
<inertia ixx="0.01" iyy="0.01" izz="0.01" ixy="0" ixz="0" iyz="0"/></inertial></link>
<joint name="rail" type="prismatic"><parent link="base"/><child link="cart"/>
<axis xyz="1 0 0"/><limit lower="-9" upper="9" effort="20" velocity="9"/></joint></robot>
"""
POLE = """
<link name="pole"><inertial><origin xyz="0 0 -0.3"/><mass value="0.3"/>
<inertia ixx="0.01" iyy="0.01" izz="0.01" ixy="0" ixz="0" iyz="0"/></inertial></link>
<joint name="hinge" type="continuous"><parent link="cart"/><child link="pole"/>
<axis xyz="0 1 0"/></joint></robot>
"""


def cart_pole(folder: Path) -> Robot:
    """The cart with a pole that hangs from it, made in an empty folder."""
    return cart(folder, URDF.replace('</robot>', POLE))


def cart(folder: Path, urdf: str = URDF) -> Robot:
    """The robot, made in an empty folder."""
    figures = (
        'name: cart\ninput: torque\ncontrol_period: 0.01\nintegration_step: 0.01\n'
        'state_rate: 100\nepisode_seconds: 20\ngravity: {value: 9.81, unit: m/s2}\n'
        'actuators: {rail: {limit: {value: 20, unit: N m}}}\nstart_poses: {nominal: {}}\n'
    )
    return made(folder, urdf, figures)
