# SPDX-License-Identifier: Apache-2.0
"""Start the robot node: ros2 launch leo_sim robot.launch.py robot:=pendulum."""
from launch import LaunchDescription
from launch.actions import DeclareLaunchArgument
from launch.substitutions import LaunchConfiguration, PathJoinSubstitution
from launch_ros.actions import Node
from launch_ros.parameter_descriptions import ParameterValue
from launch_ros.substitutions import FindPackageShare

DEFAULT_PARAMETERS = [FindPackageShare('leo_sim'), 'config', 'robot.yaml']


def generate_launch_description() -> LaunchDescription:
    arguments = (
        ('robot', 'pendulum', 'a shipped robot, or the path of a robot folder', str),
        ('driver', 'simulated', 'simulated, replay, or a driver of your own', str),
        ('realtime_factor', '1.0', 'robot seconds per wall second; 0.0 is lockstep', float),
        ('hidden', '', 'file with the effects to hide in the simulated robot', str),
    )
    declared = [DeclareLaunchArgument(n, default_value=d, description=h)
                for n, d, h, _ in arguments]
    declared.append(DeclareLaunchArgument(
        'params_file', default_value=PathJoinSubstitution(DEFAULT_PARAMETERS),
        description='parameters of the robot node'))
    chosen = {n: ParameterValue(LaunchConfiguration(n), value_type=t) for n, _, _, t in arguments}
    node = Node(
        package='leo_sim', executable='robot', output='screen',
        parameters=[LaunchConfiguration('params_file'), chosen])
    return LaunchDescription([*declared, node])
