# SPDX-License-Identifier: Apache-2.0
"""Start the difference-model node: ros2 launch leo_diffmodel diffmodel.launch.py bag:=runs/a.

An argument that is given wins over the parameter file; the others leave it as it is.
"""

from launch import LaunchDescription

from leo_sim.common.launching import described

PARAMETERS = {
    'bag': (str, 'folder of the first bag'),
    'robot': (str, 'model named in the bag where no robot node says it'),
    'model': (str, 'model file or robot the difference model corrects'),
    'effect': (str, 'Python file of an effect that the model names and that may run'),
    'difference': (str, 'difference model: recommended, torque, full or thesis'),
}


def generate_launch_description() -> LaunchDescription:
    return described('leo_diffmodel', 'diffmodel', PARAMETERS)
