# SPDX-License-Identifier: Apache-2.0
"""Start the learner node: ros2 launch leo_learner learner.launch.py model:=pendulum.

An argument that is given wins over the parameter file; the others leave it as it is.
"""

from launch import LaunchDescription

from leo_sim.common.launching import described

PARAMETERS = {
    'model': (str, 'model file or robot to train on'),
    'effect': (str, 'Python file of an effect that the model names and that may run'),
    'folder': (str, 'checkpoints, policies and curves; an unfinished run there goes on'),
    'config': (str, 'DDPG configuration: recommended or thesis'),
    'updates': (int, 'updates of the difference model'),
    'seed': (int, 'of everything drawn'),
}


def generate_launch_description() -> LaunchDescription:
    return described('leo_learner', 'learner', PARAMETERS)
