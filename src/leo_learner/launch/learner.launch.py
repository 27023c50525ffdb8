# SPDX-License-Identifier: Apache-2.0
"""Start the learner node: ros2 launch leo_learner learner.launch.py model:=pendulum.

An argument that is given wins over the parameter file; the others leave it as it is.
"""

from launch import LaunchContext, LaunchDescription
from launch.actions import DeclareLaunchArgument, OpaqueFunction
from launch.substitutions import LaunchConfiguration, PathJoinSubstitution
from launch_ros.actions import Node
from launch_ros.substitutions import FindPackageShare

PACKAGE = 'leo_learner'
PARAMETERS = {
    'model': (str, 'model file or robot to train on'),
    'effect': (str, 'Python file of an effect that the model names and that may run'),
    'folder': (str, 'checkpoints, policies and curves; an unfinished run there goes on'),
    'config': (str, 'DDPG configuration: recommended or thesis'),
    'updates': (int, 'updates of the difference model'),
    'seed': (int, 'of everything drawn'),
}


def generate_launch_description() -> LaunchDescription:
    declared = [
        DeclareLaunchArgument(name, default_value='', description=text)
        for name, (_, text) in PARAMETERS.items()
    ]
    file = DeclareLaunchArgument(
        'params_file',
        default_value=PathJoinSubstitution([FindPackageShare(PACKAGE), 'config', 'learner.yaml']),
        description='parameters of the node',
    )
    return LaunchDescription([*declared, file, OpaqueFunction(function=learner_node)])


def learner_node(context: LaunchContext) -> list[Node]:
    given = {
        name: kind(text)
        for name, (kind, _) in PARAMETERS.items()
        if (text := LaunchConfiguration(name).perform(context))
    }
    file = LaunchConfiguration('params_file')
    return [Node(package=PACKAGE, executable='learner', output='screen', parameters=[file, given])]
