# SPDX-License-Identifier: Apache-2.0
"""A cart that a motor pushes along a level rail: its only joint slides."""

from pathlib import Path

from leo_sim.description.robot import load_robot, Robot

URDF = """
<robot name="cart"><link name="base"/>
<link name="cart"><inertial><mass value="2"/>
<inertia ixx="0.01" iyy="0.01" izz="0.01" ixy="0" ixz="0" iyz="0"/></inertial></link>
<joint name="rail" type="prismatic"><parent link="base"/><child link="cart"/>
<axis xyz="1 0 0"/><limit lower="-9" upper="9" effort="20" velocity="9"/></joint></robot>
"""


def cart(folder: Path) -> Robot:
    """The robot, made in an empty folder."""
    (folder / 'robot.urdf').write_text(URDF)
    (folder / 'robot.yaml').write_text(
        'name: cart\ninput: torque\ncontrol_period: 0.01\nintegration_step: 0.01\n'
        'state_rate: 100\nepisode_seconds: 20\ngravity: {value: 9.81, unit: m/s2}\n'
        'actuators: {rail: {limit: {value: 20, unit: N m}}}\nstart_poses: {nominal: {}}\n'
    )
    return load_robot(folder)
