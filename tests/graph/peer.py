# SPDX-License-Identifier: Apache-2.0
"""A node for tests to talk to: publishes, latches, echoes, serves, has parameters."""

import os
import sys
from typing import Any

from leo_msgs_py import messages as m
from leo_msgs_py.node import api
from leo_msgs_py.qos import best_effort, latched, reliable


def main() -> int:
    """Run until told to stop."""
    node = api.create_node('talker', sys.argv[1:])
    node.declare_parameter('gain', 1.5)
    node.declare_parameter('names', ['a', 'b'])
    node.declare_parameter('fixed', 3, m.ParameterDescriptor(read_only=True))
    node.declare_parameter('secret', 'hush', private=True)
    states = node.create_publisher(m.JointState, 'joint_states', reliable(10))
    enabled = node.create_publisher(m.Bool, 'enabled', latched())
    echo = node.create_publisher(m.Float64MultiArray, 'echo', reliable(10))
    noise = node.create_publisher(m.UInt32, 'noise', best_effort(1))
    enabled.publish(m.Bool(data=True))
    node.create_subscription(m.Float64MultiArray, 'commands', echo.publish, reliable(1))

    def tick() -> None:
        stamp = node.get_clock().now().to_msg()
        header = m.Header(stamp=stamp, frame_id='base')
        states.publish(m.JointState(header=header, name=['pivot'], position=[0.5]))
        noise.publish(m.UInt32(data=1))

    def home(_: Any, response: Any) -> Any:
        response.success, response.message = True, 'homed'
        return response

    def cpu(_: Any, response: Any) -> Any:
        response.success, response.message = True, str(sum(os.times()[:2]))
        return response

    node.create_timer(0.02, tick)
    node.create_service(m.Trigger, 'home', home)
    node.create_service(m.Trigger, 'cpu', cpu)
    node.create_client(m.SetBool, 'torque')
    api.spin(node)
    api.shutdown()
    return 0


if __name__ == '__main__':
    raise SystemExit(main())
