# SPDX-License-Identifier: Apache-2.0
"""Every topic and service of the graph: type, name, quality of service.

Names are relative to the node's namespace except `/clock` and `/diagnostics`. A topic unpacks
into rclpy's arguments: `node.create_publisher(*topics.JOINT_STATES)`.
"""

from typing import Any, NamedTuple

from diagnostic_msgs.msg import DiagnosticArray
from rclpy.qos import DurabilityPolicy, HistoryPolicy, QoSProfile, ReliabilityPolicy
from rosgraph_msgs.msg import Clock
from sensor_msgs.msg import BatteryState, JointState, Temperature
from std_msgs.msg import Bool, Float64MultiArray, String, UInt8MultiArray, UInt32
from std_srvs.srv import SetBool, Trigger

INTERFACES = ('voltage', 'effort', 'position')


class Topic(NamedTuple):
    type: Any
    name: str
    qos: QoSProfile


class Service(NamedTuple):
    type: Any
    name: str


LATCHED = QoSProfile(depth=1, durability=DurabilityPolicy.TRANSIENT_LOCAL)
"""Late joiners get the last message."""
DEEP = QoSProfile(depth=1000)
"""Never holds the writer up; a reader that is 1000 messages behind loses some."""
LOSSLESS = QoSProfile(depth=1, history=HistoryPolicy.KEEP_ALL)
"""From such a writer to such a reader nothing is lost: a full reader holds the writer up."""

# robot -> all: rad, rad/s (m, m/s), stamp = time of measurement
JOINT_STATES = Topic(JointState, 'joint_states', QoSProfile(depth=10))
# learner -> robot: V (N m, rad) in actuator order, by the interface of the robot's input
COMMANDS = {
    interface: Topic(Float64MultiArray, f'{interface}_controller/commands', QoSProfile(depth=1))
    for interface in INTERFACES
}
# robot -> recorder: what was really applied, V (N m) in `effort`, rad in `position`, NaN where
# the motor is free
APPLIED = {
    interface: Topic(JointState, f'robot/applied_{interface}', QoSProfile(depth=10))
    for interface in INTERFACES
}
# hardware that measures them -> recorder: V; A in `effort`; deg C, frame_id = joint
SUPPLY = Topic(BatteryState, 'robot/supply', QoSProfile(depth=10))
CURRENT = Topic(JointState, 'robot/current', QoSProfile(depth=10))
TEMPERATURE = Topic(Temperature, 'robot/temperature', QoSProfile(depth=10))
EPISODE = Topic(UInt32, 'robot/episode', LATCHED)
E_STOPPED = Topic(Bool, 'robot/e_stopped', LATCHED)
ROBOT_DESCRIPTION = Topic(String, 'robot_description', LATCHED)
CLOCK = Topic(Clock, '/clock', QoSProfile(depth=1, reliability=ReliabilityPolicy.BEST_EFFORT))
DIAGNOSTICS = Topic(DiagnosticArray, '/diagnostics', QoSProfile(depth=10))
# any -> difference-model node -> any, and its weights for the learner
DIFFERENCE_QUERY = Topic(JointState, 'difference_model/query', QoSProfile(depth=10))
DIFFERENCE_CORRECTION = Topic(JointState, 'difference_model/correction', QoSProfile(depth=10))
DIFFERENCE_WEIGHTS = Topic(UInt8MultiArray, 'difference_model/weights', LATCHED)

RESET = Service(Trigger, 'robot/reset')
E_STOP = Service(Trigger, 'robot/e_stop')
E_STOP_RESET = Service(Trigger, 'robot/e_stop_reset')
TORQUE = Service(SetBool, 'robot/torque')
DIFFERENCE_UPDATE = Service(Trigger, 'difference_model/update')
