# SPDX-License-Identifier: Apache-2.0
"""The node API on rclpy: rclpy's own nodes with the few differences `node.api` promises."""

from __future__ import annotations

from collections.abc import Callable
import os
import signal
import threading
from typing import Any

import rclpy
from rclpy.clock import Clock, ClockType
from rclpy.duration import Duration
from rclpy.executors import ExternalShutdownException, SingleThreadedExecutor
from rclpy.node import Node
from rclpy.parameter import Parameter
from rclpy.publisher import Publisher
from rclpy.utilities import get_rmw_implementation_identifier

from leo_msgs_py import messages
from leo_msgs_py.node.args import RosArgs
from leo_msgs_py.node.parameters import cast, parameter_type

_executors: list[SingleThreadedExecutor] = []


class SecondsPublisher(Publisher):
    """A publisher whose `wait_for_all_acked` takes seconds."""

    def wait_for_all_acked(self, timeout: float) -> bool:
        """Whether all reliable subscriptions acknowledged everything within the time [s]."""
        return super().wait_for_all_acked(Duration(seconds=timeout))


class RosNode(Node):
    """An rclpy node with types by name, private parameters and lenient numbers.

    Args:
        name: node name, unless the process's arguments give another.
        args: what `--ros-args` said.
    """

    def __init__(self, name: str, args: RosArgs) -> None:
        self._leo_args = args
        self._leo_private: dict[str, Parameter] = {}
        super().__init__(name)

    def create_publisher(
        self, msg_type: Any, topic: str, qos_profile: Any, **options: Any
    ) -> Publisher:
        """Publisher of a message class or type name on a topic."""
        options.setdefault('publisher_class', SecondsPublisher)
        return super().create_publisher(_type(msg_type), topic, qos_profile, **options)

    def create_subscription(
        self,
        msg_type: Any,
        topic: str,
        callback: Callable[..., None],
        qos_profile: Any,
        **options: Any,
    ) -> Any:
        """Subscription to a message class or type name."""
        return super().create_subscription(
            _type(msg_type), topic, callback, qos_profile, **options
        )

    def declare_parameter(
        self,
        name: str,
        value: Any = None,
        descriptor: Any = None,
        ignore_override: bool = False,
        *,
        private: bool = False,
    ) -> Parameter:
        """Declare a parameter; a private one is known to this process alone.

        Raises:
            UserError: the command line gives a value of another type than the default's.
        """
        if not ignore_override:
            value = self._overridden(name, value)
        if private:
            self._leo_private[name] = Parameter(name, value=value)
            return self._leo_private[name]
        descriptor = descriptor or messages.ParameterDescriptor()
        return super().declare_parameter(name, value, descriptor, ignore_override=True)

    def get_parameter(self, name: str) -> Parameter:
        """A declared parameter with `.value`."""
        return self._leo_private.get(name) or super().get_parameter(name)

    def _overridden(self, name: str, default: Any) -> Any:
        value = self._leo_args.overrides(self.get_fully_qualified_name()).get(name, default)
        return value if default is None else cast(name, value, parameter_type(default))


class _Interrupts:
    """Lets rclpy's own handler end spinning on the first SIGINT; the second interrupts."""

    seen = False

    def handle(self, number: int, frame: Any) -> None:
        """Python's handler, called by rclpy's after it has asked for the shutdown."""
        if self.seen:
            raise KeyboardInterrupt
        self.seen = True


def create_node(name: str, args: list[str], parsed: RosArgs) -> RosNode:
    """Create a node, and with the first one start rclpy."""
    if not _executors:
        if threading.current_thread() is threading.main_thread():
            signal.signal(signal.SIGINT, _Interrupts().handle)
        rclpy.init(args=['leo', *args])
        _executors.append(SingleThreadedExecutor())
    node = RosNode(name, parsed)
    _executors[0].add_node(node)
    node.get_logger().info(describe())
    return node


def spin_once(node: RosNode, timeout_sec: float | None) -> None:
    """Run one callback that is ready on any node of the process."""
    try:
        _executors[0].spin_once(timeout_sec)
    except (KeyboardInterrupt, ExternalShutdownException):
        rclpy.try_shutdown()


def ok() -> bool:
    """Whether rclpy runs."""
    return rclpy.ok()


def shutdown() -> None:
    """Destroy the nodes and shut rclpy down."""
    if _executors:
        executor = _executors.pop()
        for node in executor.get_nodes():
            node.destroy_node()
        executor.shutdown()
    rclpy.try_shutdown()


def wall_clock() -> Clock:
    """A clock that no /clock stops."""
    return Clock(clock_type=ClockType.STEADY_TIME)


def _type(msg_type: Any) -> Any:
    return messages.load(msg_type) if isinstance(msg_type, str) else msg_type


def describe() -> str:
    """Transport, domain and discovery range in words."""
    domain = os.environ.get('ROS_DOMAIN_ID') or '0'
    reach = os.environ.get('ROS_AUTOMATIC_DISCOVERY_RANGE') or 'SUBNET'
    rmw = get_rmw_implementation_identifier()
    return f'rclpy transport ({rmw}), ROS_DOMAIN_ID {domain}, discovery {reach}'
