# SPDX-License-Identifier: Apache-2.0
"""`leo bag play`: a bag back into the graph, with its types, QoS, stamps and timing."""

from __future__ import annotations

from pathlib import Path
import time

from rclpy.duration import Duration
from rclpy.node import Node
from rclpy.publisher import Publisher
from rclpy.qos import DurabilityPolicy, HistoryPolicy, QoSProfile, ReliabilityPolicy

from leo_msgs_py.errors import UserError
from leo_msgs_py.interfaces import load as load_type
from leo_msgs_py.node import graph, join, running, spin_once, spin_until
from leo_msgs_py.terminal import visible

from .contents import load, TopicLog
from .types import from_yaml

DISCOVERY_SECONDS = 1.0
ACKNOWLEDGE_SECONDS = 4.0
"""Fast DDS by itself asks its readers every 3 s what they have, with our profile every 0.1 s."""
DEPTH = 1000


def play(
    bag: Path, rate: float, loop: bool, ros_args: list[str], wait: float = DISCOVERY_SECONDS
) -> int:
    """Publish a bag and return the exit status.

    Args:
        bag: a rosbag2 folder or .mcap file.
        rate: speed; 1 = as logged.
        loop: again and again until SIGINT.
        ros_args: `--ros-args ...`, remaps for instance.
        wait: so long for a reader of every topic before the first message [s].

    Raises:
        UserError: no bag there, nothing in it that can be published, a rate of 0 or less, or a
            wait below 0.
    """
    if not rate > 0.0:
        raise UserError(f'--rate {rate:g} is not a speed; give a number above 0')
    if not wait >= 0.0:
        raise UserError(f'--wait {wait:g} is no time; give 0 or more seconds')
    contents = load(bag)
    with graph(ros_args):
        node = join(Node('player'))
        publishers = _publishers(node, list(contents.topics.values()))
        if not publishers:
            raise UserError(f'{bag} has no messages of a type known here')
        player = _Player(publishers, rate)
        player.wait_for_readers(wait)
        player.play_once()
        while loop and running():
            player.play_once()
        player.acknowledge()
    print(f'played {bag}: {player.played} messages')
    return 0


def _publishers(node: Node, topics: list[TopicLog]) -> list[tuple[Publisher, TopicLog]]:
    found = []
    for topic in topics:
        try:
            message_type = load_type(topic.type)
        except UserError as error:
            node.get_logger().warning(visible(f'{topic.name} is not played: {error}'))
            continue
        if topic.messages:
            publisher = node.create_publisher(message_type, topic.name, _offered(topic.qos))
            found.append((publisher, topic))
    return found


def _offered(text: str) -> QoSProfile:
    """Return the QoS recorded, but deep enough that a slow reader loses nothing.

    What is latched keeps its depth: it is what a late reader gets.
    """
    recorded = from_yaml(text)
    qos = QoSProfile(
        depth=recorded.depth,
        history=HistoryPolicy[recorded.history.upper()],
        reliability=ReliabilityPolicy[recorded.reliability.upper()],
        durability=DurabilityPolicy[recorded.durability.upper()],
    )
    if qos.durability != DurabilityPolicy.TRANSIENT_LOCAL:
        qos.depth = max(qos.depth, DEPTH)
    return qos


class _Player:
    """Publishes the messages of all topics in log order, at their distances in time."""

    def __init__(self, publishers: list[tuple[Publisher, TopicLog]], rate: float) -> None:
        self._rate = rate
        self._publishers = [publisher for publisher, _ in publishers]
        self._messages = sorted(
            (
                (message.log_ns, message.data, publisher)
                for publisher, topic in publishers
                for message in topic.messages
            ),
            key=lambda entry: entry[0],
        )
        self.played = 0

    def wait_for_readers(self, seconds: float) -> None:
        """Wait until every topic has a reader, at most so long."""
        spin_until(self._all_have_readers, seconds)

    def play_once(self) -> None:
        """Publish everything once, or until the process shall end."""
        first = self._messages[0][0]
        began = time.monotonic()
        for log_ns, data, publisher in self._messages:
            due = began + (log_ns - first) * 1e-9 / self._rate
            while running() and (left := due - time.monotonic()) > 0.0:
                spin_once(left)
            if not running():
                return
            publisher.publish(data)
            self.played += 1

    def acknowledge(self) -> None:
        """Wait until the reliable readers have everything."""
        end = time.monotonic() + ACKNOWLEDGE_SECONDS
        for publisher in self._publishers:
            if running():
                left = max(0.0, end - time.monotonic())
                publisher.wait_for_all_acked(Duration(seconds=left))

    def _all_have_readers(self) -> bool:
        return all(publisher.get_subscription_count() for publisher in self._publishers)
