# SPDX-License-Identifier: Apache-2.0
"""Start the robot node: ros2 launch leo_sim robot.launch.py robot:=pendulum realtime_factor:=0.

An argument that is given wins over the parameter file; the others leave it as it is.
"""

from launch import LaunchDescription

from leo_sim.common.launching import described

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
    return described('leo_sim', 'robot', PARAMETERS)
