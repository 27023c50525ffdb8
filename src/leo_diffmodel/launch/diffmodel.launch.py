# SPDX-License-Identifier: Apache-2.0
"""Start the difference-model node: ros2 launch leo_diffmodel diffmodel.launch.py bag:=runs/a.

An argument that is given wins over the parameter file; the others leave it as it is.
"""

from launch import LaunchContext, LaunchDescription
from launch.actions import DeclareLaunchArgument, OpaqueFunction
from launch.substitutions import LaunchConfiguration, PathJoinSubstitution
from launch_ros.actions import Node
from launch_ros.substitutions import FindPackageShare

PACKAGE = 'leo_diffmodel'
PARAMETERS = {
    'bag': 'folder of the first bag',
    'robot': 'model named in the bag where no robot node says it',
    'model': 'model file or robot the difference model corrects',
    'effect': 'Python file of an effect that the model names and that may run',
    'difference': 'difference model: recommended, torque, full or thesis',
}


def generate_launch_description() -> LaunchDescription:
    declared = [
        DeclareLaunchArgument(name, default_value='', description=text)
        for name, text in PARAMETERS.items()
    ]
    file = DeclareLaunchArgument(
        'params_file',
        default_value=PathJoinSubstitution(
            [FindPackageShare(PACKAGE), 'config', 'diffmodel.yaml']
        ),
        description='parameters of the node',
    )
    return LaunchDescription([*declared, file, OpaqueFunction(function=diffmodel_node)])


def diffmodel_node(context: LaunchContext) -> list[Node]:
    values = {name: LaunchConfiguration(name).perform(context) for name in PARAMETERS}
    given = {name: value for name, value in values.items() if value}
    file = LaunchConfiguration('params_file')
    return [
        Node(package=PACKAGE, executable='diffmodel', output='screen', parameters=[file, given])
    ]
