# SPDX-License-Identifier: Apache-2.0
"""Every topic and service of the graph: type, name, quality of service.

Names are relative to the node's namespace except `/clock` and `/diagnostics`. A topic unpacks
into rclpy's arguments: `node.create_publisher(*topics.JOINT_STATES)`.
"""

from typing import Any, NamedTuple

from leo_msgs_py import messages as m
from leo_msgs_py.qos import best_effort, latched, QoSProfile, reliable


class Topic(NamedTuple):
    """A topic in rclpy's argument order."""

    type: Any
    name: str
    qos: QoSProfile


class Service(NamedTuple):
    """A service in rclpy's argument order."""

    type: Any
    name: str


# robot -> all: rad, rad/s (m, m/s), stamp = time of measurement
JOINT_STATES = Topic(m.JointState, 'joint_states', reliable(10))
# learner -> robot: V (N m) in actuator order
VOLTAGE_COMMANDS = Topic(m.Float64MultiArray, 'voltage_controller/commands', reliable(1))
EFFORT_COMMANDS = Topic(m.Float64MultiArray, 'effort_controller/commands', reliable(1))
# robot -> recorder: what was really applied
DYNAMIC_JOINT_STATES = Topic(m.DynamicJointState, 'dynamic_joint_states', reliable(10))
EPISODE = Topic(m.UInt32, 'robot/episode', latched())
E_STOPPED = Topic(m.Bool, 'robot/e_stopped', latched())
ROBOT_DESCRIPTION = Topic(m.String, 'robot_description', latched())
CLOCK = Topic(m.Clock, '/clock', best_effort(1))
DIAGNOSTICS = Topic(m.DiagnosticArray, '/diagnostics', reliable(10))
# any -> difference-model node -> any, and its weights for the learner
DIFFERENCE_QUERY = Topic(m.DynamicJointState, 'difference_model/query', reliable(10))
DIFFERENCE_CORRECTION = Topic(m.JointState, 'difference_model/correction', reliable(10))
DIFFERENCE_WEIGHTS = Topic(m.UInt8MultiArray, 'difference_model/weights', latched())

RESET = Service(m.Trigger, 'robot/reset')
E_STOP = Service(m.Trigger, 'robot/e_stop')
E_STOP_RESET = Service(m.Trigger, 'robot/e_stop_reset')
TORQUE = Service(m.SetBool, 'robot/torque')
DIFFERENCE_UPDATE = Service(m.Trigger, 'difference_model/update')
