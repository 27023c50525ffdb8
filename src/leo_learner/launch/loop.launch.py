# SPDX-License-Identifier: Apache-2.0
"""Start robot, difference model and learner: ros2 launch leo_learner loop.launch.py seed:=1.

The robot hides the effects of the file `hidden`, runs in lockstep with the learner, and starts
each episode anywhere, as Algorithm 5 wants it.
"""

from launch import LaunchDescription
from launch.actions import DeclareLaunchArgument, EmitEvent, RegisterEventHandler
from launch.event_handlers import OnProcessExit
from launch.events import Shutdown
from launch.substitutions import LaunchConfiguration
from launch_ros.actions import Node
from launch_ros.parameter_descriptions import ParameterValue

ARGUMENTS = {
    'robot': ('pendulum', 'a shipped robot, or the path of a robot folder'),
    'model': ('pendulum', 'model file or robot to train on'),
    'hidden': ('', 'file with the effects to hide in the simulated robot'),
    'effect': ('', 'Python file of an effect that one of these names and that may run'),
    'folder': ('runs/loop', 'where bags, checkpoints and policies go'),
    'seed': ('0', 'of everything drawn'),
}


def generate_launch_description() -> LaunchDescription:
    given = {name: LaunchConfiguration(name) for name in ARGUMENTS}
    seed = {'seed': ParameterValue(given['seed'], value_type=int)}
    effect = {'effect': given['effect']}
    model = {'model': given['model']} | effect
    lockstep = {'realtime_factor': 0.0, 'start': 'random'}
    described = {'robot': given['robot'], 'hidden': given['hidden']}
    robot = _node('leo_sim', 'robot', seed | effect | described | lockstep)
    diffmodel = _node('leo_diffmodel', 'diffmodel', model | {'bag': [given['folder'], '/rollout']})
    learner = _node('leo_learner', 'learner', seed | model | {'folder': given['folder']})
    end = OnProcessExit(target_action=learner, on_exit=[EmitEvent(event=Shutdown())])
    declared = [
        DeclareLaunchArgument(name, default_value=default, description=text)
        for name, (default, text) in ARGUMENTS.items()
    ]
    return LaunchDescription([*declared, robot, diffmodel, learner, RegisterEventHandler(end)])


def _node(package: str, executable: str, parameters: dict) -> Node:
    return Node(package=package, executable=executable, output='screen', parameters=[parameters])
