# SPDX-License-Identifier: Apache-2.0
"""Who commands the robot: one at a time, and nothing that was sent long ago."""

from __future__ import annotations

import time
from typing import Any

from rclpy.node import Node

from leo_sim.nodes.senders import Ages, Turns


class Commander:
    """Judges messages on the command topic by what the middleware says of them.

    Args:
        node: the robot's, for its log and graph.
        topic: resolved name of the command topic.
        limit: age [s] from which a command is stale; 0 disables.

    Attributes:
        count: how many could command when `count_them` was last called.
    """

    def __init__(self, node: Node, topic: str, limit: float) -> None:
        self._node, self._topic = node, topic
        self._ages, self._turns = Ages(limit), Turns()
        self.count = 0

    @property
    def stale(self) -> int:
        """How many commands came too late."""
        return self._ages.stale

    def is_new(self, info: dict[str, Any]) -> bool:
        """Whether a message was sent just now; says where it was not."""
        age = self._ages.too_old(info['source_timestamp'], time.time_ns())
        if age:
            self._node.get_logger().error(
                f'command ignored: it was sent {age:.2f} s ago by the clock of its sender; a slow '
                'network, or a clock that is wrong',
                throttle_duration_sec=1.0,
            )
        return not age

    def has_rival(self, info: dict[str, Any]) -> bool:
        """Whether this message and those before it came from two senders in turns; says so."""
        taken = self._turns.taken(info['publication_sequence_number'], time.monotonic())
        rival = taken and self._node.count_publishers(self._topic) > 1
        if rival:
            self._node.get_logger().error(
                f'two send commands in turns on {self._topic}: end one of them, then call '
                '/robot/e_stop_reset'
            )
        return rival

    def count_them(self) -> None:
        """Look how many could command; warn of a second one."""
        before, self.count = self.count, self._node.count_publishers(self._topic)
        if self.count > max(1, before):
            self._node.get_logger().warning(
                f'{self.count} publishers on {self._topic}; one at a time may command, and two '
                'that send in turns stop the robot'
            )
