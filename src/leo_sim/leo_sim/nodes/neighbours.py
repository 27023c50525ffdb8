# SPDX-License-Identifier: Apache-2.0
"""Other robots that obey the same commands, which nobody wants and nobody notices."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable
from typing import Any

from rclpy.node import Node

LOOKS = 5
"""A node that was killed is listed for so many seconds, one look each; it is no neighbour."""


class Neighbours:
    """Finds nodes that publish the robot's states and listen to its commands, as it does.

    Args:
        robot: the node itself.
        states: resolved name of the topic of states.
        commands: that of the commands.
    """

    def __init__(self, robot: Node, states: str, commands: str) -> None:
        self._robot, self._states, self._commands = robot, states, commands
        self._seen: Counter[str] = Counter()
        self._warned: set[str] = set()

    @property
    def names(self) -> list[str]:
        """Names of the other robots, with their namespaces."""
        return sorted(name for name, looks in self._seen.items() if looks > LOOKS)

    def look(self) -> None:
        """Look who is there, once a second; warn of each once."""
        self._seen = Counter({name: self._seen[name] + 1 for name in self._others()})
        for name in set(self.names) - self._warned:
            self._warned.add(name)
            self._robot.get_logger().warning(
                f'another robot, {name}, obeys the commands on {self._commands} too and publishes '
                f'{self._states}; give each a ROS_DOMAIN_ID or a namespace (-r __ns:=/left)'
            )

    def _others(self) -> Counter[str]:
        """Robots beside this one, which may have its name."""
        publishers = self._robot.get_publishers_info_by_topic(self._states)
        listeners = self._robot.get_subscriptions_info_by_topic(self._commands)
        robots = _names(publishers) & _names(listeners)
        return robots - Counter([self._robot.get_fully_qualified_name()])


def _names(endpoints: Iterable[Any]) -> Counter[str]:
    return Counter(f'{e.node_namespace.rstrip("/")}/{e.node_name}' for e in endpoints)
