# SPDX-License-Identifier: Apache-2.0
"""What the robot node says when it starts: what runs, and what to type next."""

from __future__ import annotations

from leo_msgs_py import topics
from leo_msgs_py.terminal import leo
from leo_sim.drivers.base import DriverInfo
from leo_sim.nodes.parameters import Settings


def greeting(settings: Settings, info: DriverInfo) -> list[str]:
    """Lines for the log of a node with a driver."""
    robot = settings.options.robot
    pace = f'{settings.realtime_factor:g} x real time' if settings.realtime_factor else 'lockstep'
    command = topics.COMMANDS[info.interface].name
    zeros = ', '.join(['0.0'] * len(info.actuators))
    lines = [
        f'{robot.name}, driver {settings.driver}, {pace}: states at '
        f'{info.state_rate:g} Hz, one {info.interface} command each '
        f'{info.control_period * 1e3:g} ms for {", ".join(info.actuators)}',
        f'try: leo topic echo /joint_states; leo topic pub -r 20 /{command} '
        f"std_msgs/msg/Float64MultiArray '{{data: [{zeros}]}}'; leo service call /robot/reset "
        'std_srvs/srv/Trigger',
    ]
    others = [pose for pose in robot.start_poses if pose != settings.options.start]
    if others and settings.driver == 'simulated':
        lines.append(
            f'starts in {settings.options.start}; '
            f'{leo("param", "set", "/robot", "start", others[-1])} puts it there '
            f'({", ".join(robot.start_poses)})'
        )
    return lines
