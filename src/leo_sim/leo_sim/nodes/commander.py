# SPDX-License-Identifier: Apache-2.0
"""Who commands the robot, one at a time and nothing sent long ago; and who else obeys it."""

from collections import Counter
from collections.abc import Iterable, Iterator
import math
import time
from typing import Any

from rclpy.node import Node
from rclpy.qos import QoSProfile

from leo_msgs_py.hostile import complain, seldom, UNREADABLE
from leo_msgs_py.node import Heard, listen_with_info
from leo_msgs_py.topics import Topic

LOOKS = 5
"""A node that was killed is listed for so many seconds, one look each; it is no neighbour."""
KEPT = 20  # messages of strangers that may come between two looks and displace no command
WINDOW = 1.0  # two senders that take turns twice within this time [s] both speak


class Ages:
    """How long a command was under way, by the time its sender stamped on the message.

    A sender whose clock is ahead of ours is taken as it is: the youngest message so far counts
    as new. One whose clock is behind looks like a slow network, and its commands count as old;
    the clocks of two machines must agree to within `limit` [s], 0 disables.
    """

    def __init__(self, limit: float) -> None:
        self._limit = limit
        self._youngest = 0.0
        self.stale = 0  # how many commands came too late

    def too_old(self, sent_ns: int, now_ns: int) -> float:
        """The age [s] of a stale command, 0 of any other; `sent_ns` is 0 where nobody knows."""
        if not self._limit or not sent_ns:
            return 0.0
        age = (now_ns - sent_ns) * 1e-9
        self._youngest = min(self._youngest, age)
        if age - self._youngest <= self._limit:
            return 0.0
        self.stale += 1
        return age - self._youngest


class Turns:
    """Notice two senders that speak in turns: the message numbers of one sender only grow."""

    def __init__(self) -> None:
        self._number = 0
        self._fell = -math.inf

    def taken(self, number: int | None, now: float) -> bool:
        """Whether the numbers have fallen twice within the window, at time `now` [s].

        One sender that gives way to another makes them fall once at most. `number` counts the
        messages of its sender; None where the middleware does not.
        """
        if number is None:
            return False
        fell, self._number = number <= self._number, number
        if not fell:
            return False
        before, self._fell = self._fell, now
        return now - before < WINDOW


class Commander:
    """Listens to the command topic, and judges messages by what the middleware says of them.

    The callback gets both. `limit` is the age [s] from which a command is stale; 0 disables.
    """

    def __init__(self, node: Node, topic: Topic, callback: Heard, limit: float) -> None:
        kept = topic._replace(qos=QoSProfile(depth=KEPT))
        self._node, self._commands = node, listen_with_info(node, kept, callback)
        self.topic_name = self._commands.topic_name
        self.ages, self._turns = Ages(limit), Turns()
        self.count = 0

    def drop(self) -> None:
        """Forget what came before the state it should answer, say to a repeated one."""
        list(self.waiting())

    def waiting(self) -> Iterator[tuple[Any, dict[str, Any]]]:
        """Take what has arrived, oldest first: messages and what the middleware says of them."""
        commands = self._commands
        for _ in range(KEPT):
            try:
                found = commands.handle.take_message(commands.msg_type, commands.raw)
                if found is None:
                    return
                yield found
            except UNREADABLE as error:
                complain(error)

    def is_new(self, info: dict[str, Any]) -> bool:
        age = self.ages.too_old(info['source_timestamp'], time.time_ns())
        if age:
            seldom(
                self._node.get_logger(),
                'stale command',
                f'command ignored: it was sent {age:.2f} s ago by the clock of its sender; a slow '
                'network, or a clock that is wrong',
            )
        return not age

    def has_rival(self, info: dict[str, Any]) -> bool:
        taken = self._turns.taken(info['publication_sequence_number'], time.monotonic())
        rival = taken and self._node.count_publishers(self.topic_name) > 1
        if rival:
            self._node.get_logger().error(
                f'two send commands in turns on {self.topic_name}: end one of them, then call '
                '/robot/e_stop_reset'
            )
        return rival

    def count_them(self) -> None:
        before, self.count = self.count, self._node.count_publishers(self.topic_name)
        if self.count > max(1, before):
            self._node.get_logger().warning(
                f'{self.count} publishers on {self.topic_name}; one at a time may command, and '
                'two that send in turns stop the robot'
            )


class Neighbours:
    """Finds nodes that publish the robot's states and listen to its commands, as it does."""

    def __init__(self, robot: Node, states: str, commands: str) -> None:
        self._robot, self._states, self._commands = robot, states, commands
        self._seen: Counter[str] = Counter()
        self._warned: set[str] = set()

    @property
    def names(self) -> list[str]:
        return sorted(name for name, looks in self._seen.items() if looks > LOOKS)

    def look(self) -> None:
        publishers = self._robot.get_publishers_info_by_topic(self._states)
        listeners = self._robot.get_subscriptions_info_by_topic(self._commands)
        robots = names_of(publishers) & names_of(listeners)
        robots -= Counter([self._robot.get_fully_qualified_name()])
        self._seen = Counter({name: self._seen[name] + 1 for name in robots})
        for name in set(self.names) - self._warned:
            self._warned.add(name)
            self._robot.get_logger().warning(
                f'another robot, {name}, obeys the commands on {self._commands} too and publishes '
                f'{self._states}; give each a ROS_DOMAIN_ID or a namespace (-r __ns:=/left)'
            )


def names_of(endpoints: Iterable[Any]) -> Counter[str]:
    return Counter(f'{e.node_namespace.rstrip("/")}/{e.node_name}' for e in endpoints)
