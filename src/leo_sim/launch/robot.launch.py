# SPDX-License-Identifier: Apache-2.0
"""Start the robot node: ros2 launch leo_sim robot.launch.py robot:=pendulum realtime_factor:=0.

An argument that is given wins over the parameter file; the others leave it as it is.
"""

from launch import LaunchContext, LaunchDescription
from launch.actions import DeclareLaunchArgument, OpaqueFunction
from launch.substitutions import LaunchConfiguration, PathJoinSubstitution
from launch_ros.actions import Node
from launch_ros.substitutions import FindPackageShare

PARAMETERS = {
    'robot': (str, 'a shipped robot, or the path of a robot folder'),
    'driver': (str, 'simulated, replay, dynamixel, or the file of a driver of your own'),
    'start': (str, 'nominal, random, or a start pose of the robot'),
    'state_rate': (float, "joint states per second [Hz]; 0: the robot's own"),
    'realtime_factor': (float, 'robot seconds per wall second; 0 is lockstep'),
    'command_timeout': (float, 'age at which a command is dropped for 0 [s]; 0: never'),
    'slew': (float, 'largest change of a command [V/s or N m/s]; 0: any'),
    'engine': (str, 'physics engine of the simulated robot'),
    'integration_step': (float, "of the simulated robot [s]; 0: the robot's own"),
    'seed': (int, 'of random start poses and noise'),
    'hidden': (str, 'file with the effects to hide in the simulated robot'),
    'hidden_seed': (int, 'draws one hidden effect and writes it sealed'),
    'effect': (str, 'Python file of an effect that `hidden` names and that may run'),
    'sealed': (str, 'where the hidden effects are written for leo reveal'),
    'bag': (str, 'the recording that driver replay plays'),
    'port': (str, 'where the hardware is connected, say /dev/ttyUSB0'),
    'fault_periods': (int, 'how many periods in a row the driver may fail before the node ends'),
}


def generate_launch_description() -> LaunchDescription:
    declared = [
        DeclareLaunchArgument(name, default_value='', description=text)
        for name, (_, text) in PARAMETERS.items()
    ]
    file = DeclareLaunchArgument(
        'params_file',
        default_value=PathJoinSubstitution([FindPackageShare('leo_sim'), 'config', 'robot.yaml']),
        description='parameters of the robot node',
    )
    return LaunchDescription([*declared, file, OpaqueFunction(function=robot_node)])


def robot_node(context: LaunchContext) -> list[Node]:
    given = {
        name: kind(text)
        for name, (kind, _) in PARAMETERS.items()
        if (text := LaunchConfiguration(name).perform(context))
    }
    file = LaunchConfiguration('params_file')
    return [Node(package='leo_sim', executable='robot', output='screen', parameters=[file, given])]
