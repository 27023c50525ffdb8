# SPDX-License-Identifier: Apache-2.0
"""A node for tests to talk to: publishes, latches, echoes, serves, has parameters."""

from collections.abc import Callable
import sys
from typing import Any

from rcl_interfaces.msg import ParameterDescriptor
from rclpy.node import Node
from sensor_msgs.msg import JointState
from std_msgs.msg import Bool, Float64MultiArray, Header, UInt32
from std_srvs.srv import SetBool, Trigger

from leo_msgs_py import topics
from leo_msgs_py.cli import executable
from leo_msgs_py.node import graph, private_parameter, spin


@executable
def main(argv: list[str]) -> int:
    with graph(argv):
        node = Node('talker')
        node.declare_parameter('gain', 1.5)
        node.declare_parameter('names', ['a', 'b'])
        node.declare_parameter('fixed', 3, ParameterDescriptor(read_only=True))
        private_parameter(node, 'secret', 'hush')
        _talk(node)
        spin(node)
    return 0


def _talk(node: Node) -> None:
    states = node.create_publisher(*topics.JOINT_STATES)
    enabled = node.create_publisher(Bool, 'enabled', topics.LATCHED)
    echo = node.create_publisher(Float64MultiArray, 'echo', 10)
    noise = node.create_publisher(UInt32, 'noise', topics.CLOCK.qos)
    enabled.publish(Bool(data=True))
    node.create_subscription(Float64MultiArray, 'commands', echo.publish, 1)

    def tick() -> None:
        header = Header(stamp=node.get_clock().now().to_msg(), frame_id='base')
        states.publish(JointState(header=header, name=['pivot'], position=[0.5]))
        noise.publish(UInt32(data=1))

    def answering(success: bool, message: str) -> Callable[[Any, Any], Any]:
        return lambda *_: Trigger.Response(success=success, message=message)

    node.create_timer(0.02, tick)
    node.create_service(Trigger, 'home', answering(True, 'homed'))
    node.create_service(Trigger, 'stuck', answering(False, 'stuck'))
    node.create_client(SetBool, 'torque')


if __name__ == '__main__':
    sys.exit(main())
