# SPDX-License-Identifier: Apache-2.0
"""A node with its parameter file, as the launch files of all packages start one."""

from collections.abc import Callable, Mapping
from typing import Any

Parameters = Mapping[str, tuple[Callable[[str], object], str]]
"""By name how the text of an argument is read, and what it is."""


def described(package: str, executable: str, parameters: Parameters) -> Any:
    """The launch description of a node; an argument that is given wins over the parameter file."""
    from launch import LaunchContext, LaunchDescription
    from launch.actions import DeclareLaunchArgument, OpaqueFunction
    from launch.substitutions import LaunchConfiguration, PathJoinSubstitution
    from launch_ros.actions import Node
    from launch_ros.substitutions import FindPackageShare

    def node(context: LaunchContext) -> list[Node]:
        texts = {name: LaunchConfiguration(name).perform(context) for name in parameters}
        given = {name: parameters[name][0](text) for name, text in texts.items() if text}
        both = [LaunchConfiguration('params_file'), given]
        return [Node(package=package, executable=executable, output='screen', parameters=both)]

    file = PathJoinSubstitution([FindPackageShare(package), 'config', f'{executable}.yaml'])
    arguments = {'params_file': (file, 'parameters of the node')}
    arguments |= {name: ('', text) for name, (_, text) in parameters.items()}
    declared = [
        DeclareLaunchArgument(name, default_value=default, description=text)
        for name, (default, text) in arguments.items()
    ]
    return LaunchDescription([*declared, OpaqueFunction(function=node)])
