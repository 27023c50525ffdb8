# SPDX-License-Identifier: Apache-2.0
"""Nodes under rclpy's names: on rclpy where it imports, else on plain DDS.

    node = create_node('robot', sys.argv[1:])
    publisher = node.create_publisher(*topics.JOINT_STATES)
    node.create_timer(0.01, lambda: publisher.publish(...))
    spin(node)
    shutdown()

All callbacks run in the thread that spins. `spin` returns on SIGINT, SIGTERM and `shutdown`.
"""

from __future__ import annotations

from collections.abc import Callable
from importlib import import_module
import time
from typing import Any

from leo_msgs_py.messages import HAVE_ROS, ParameterDescriptor
from leo_msgs_py.node import args as ros_args

_SLICE_S = 0.05
Node = Any

_backend: Any = import_module(
    'leo_msgs_py.node.rclpy_backend' if HAVE_ROS else 'leo_msgs_py.node.dds_process'
)


def create_node(name: str, args: list[str] | None = None) -> Node:
    """Create a node of this process.

    Args:
        name: node name, unless `-r __node:=` gives another.
        args: command line without the program name; `--ros-args` are heeded, the rest is not
            looked at.

    Raises:
        UserError: `--ros-args` or ROS environment variables that cannot be understood.
    """
    return _backend.create_node(name, list(args or []), ros_args.parse(args, name))


def wall_timer(node: Node, period_sec: float, callback: Callable[[], None]) -> Any:
    """Timer by the wall: it goes on where /clock stands still, as in lockstep."""
    return node.create_timer(period_sec, callback, clock=_backend.wall_clock())


def fixed_parameter(node: Node, name: str, default: Any) -> Any:
    """Declare a parameter that holds from start to end, and return its value.

    Setting it while the node runs is refused, instead of accepted without effect.
    """
    return node.declare_parameter(name, default, ParameterDescriptor(read_only=True)).value


def spin(node: Node) -> None:
    """Run the callbacks until SIGINT, SIGTERM or `shutdown`."""
    while ok():
        spin_once(node)


def spin_once(node: Node, timeout_sec: float | None = None) -> None:
    """Run what is ready, waiting for it at most so long (None: until something is)."""
    _backend.spin_once(node, timeout_sec)


def spin_until(node: Node, condition: Callable[[], bool], timeout_sec: float) -> bool:
    """Spin until the condition holds; whether it did within the time [s]."""
    deadline = time.monotonic() + timeout_sec
    while not condition():
        left = deadline - time.monotonic()
        if left <= 0 or not ok():
            return condition()
        spin_once(node, min(left, _SLICE_S))
    return True


def call(node: Node, client: Any, request: Any, timeout_sec: float) -> Any:
    """Call a service and spin until it answered; not from within a callback.

    Raises:
        TimeoutError: no server or no answer within the time [s].
    """
    deadline = time.monotonic() + timeout_sec
    if not client.wait_for_service(timeout_sec):
        raise TimeoutError(f'no server for {client.srv_name} within {timeout_sec} s')
    future = client.call_async(request)
    if not spin_until(node, future.done, max(0.0, deadline - time.monotonic())):
        client.remove_pending_request(future)
        raise TimeoutError(f'{client.srv_name} did not answer within {timeout_sec} s')
    return future.result()


def ok() -> bool:
    """Whether nodes may go on: False after SIGINT, SIGTERM and `shutdown`."""
    return _backend.ok()


def shutdown() -> None:
    """Destroy all nodes and leave the graph; peers see it at once."""
    _backend.shutdown()


def describe() -> str:
    """Transport, domain and discovery range in words."""
    text: str = _backend.describe()
    return text
