# SPDX-License-Identifier: Apache-2.0
"""`leo bag play`: a bag back into the graph, with its types, QoS, stamps and timing."""

from operator import itemgetter
from pathlib import Path
import time
from typing import TypeVar

from rclpy.duration import Duration
from rclpy.node import Node
from rclpy.publisher import Publisher
from rclpy.qos import DurabilityPolicy, HistoryPolicy, QoSProfile, ReliabilityPolicy

from leo_msgs_py.bag_contents import load, TopicLog
from leo_msgs_py.errors import UserError
from leo_msgs_py.interfaces import load as load_type
from leo_msgs_py.node import graph, join, running, spin_once, spin_until
from leo_msgs_py.terminal import visible

from .types import profiles

Policy = TypeVar('Policy', HistoryPolicy, ReliabilityPolicy, DurabilityPolicy)
DISCOVERY_SECONDS = 1.0
ACKNOWLEDGE_SECONDS = 4.0  # Fast DDS asks its readers every 3 s, with our profile every 0.1 s
DEPTH = 1000


def play(
    bag: Path, rate: float, loop: bool, ros_args: list[str], wait: float = DISCOVERY_SECONDS
) -> int:
    """Publish a bag at a speed (1 = as logged); return how many messages were published.

    It waits up to `wait` [s] for a reader of every topic; `loop` plays again and again.
    """
    if not rate > 0.0:
        raise UserError(f'--rate {rate:g} is not a speed; give a number above 0')
    if not wait >= 0.0:
        raise UserError(f'--wait {wait:g} is no time; give 0 or more seconds')
    contents = load(bag)
    with graph(ros_args):
        node = join(Node('player'))
        found = _publishers(node, list(contents.topics.values()))
        if not found:
            raise UserError(f'{bag} has no messages of a type known here')
        publishers = [publisher for publisher, _ in found]
        messages = [(m.log_ns, m.data, p) for p, topic in found for m in topic.messages]
        messages.sort(key=itemgetter(0))
        spin_until(lambda: all(p.get_subscription_count() for p in publishers), wait)
        played = _play_once(messages, rate)
        while loop and running():
            played += _play_once(messages, rate)
        end = time.monotonic() + ACKNOWLEDGE_SECONDS
        for publisher in publishers:  # until the reliable readers have everything
            if running():
                publisher.wait_for_all_acked(Duration(seconds=max(0.0, end - time.monotonic())))
    return played


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
    """Return the QoS recorded, deep enough for a slow reader; latched it keeps its depth."""
    recorded = next(iter(profiles(text)), {})
    depth = recorded.get('depth')
    qos = QoSProfile(
        depth=max(depth, 1) if isinstance(depth, int) else 10,
        history=_policy(HistoryPolicy.KEEP_LAST, recorded.get('history')),
        reliability=_policy(ReliabilityPolicy.RELIABLE, recorded.get('reliability')),
        durability=_policy(DurabilityPolicy.VOLATILE, recorded.get('durability')),
    )
    if qos.durability != DurabilityPolicy.TRANSIENT_LOCAL:
        qos.depth = max(qos.depth, DEPTH)
    return qos


def _policy(default: Policy, recorded: str | int | None) -> Policy:
    """Return a policy by its name, or by its number, as bags before version 9 have it."""
    known = [p for p in type(default) if p.value in (1, 2)]
    return next((p for p in known if recorded in (p.name.lower(), p.value)), default)


def _play_once(messages: list[tuple[int, bytes, Publisher]], rate: float) -> int:
    first, began = messages[0][0], time.monotonic()
    for played, (log_ns, data, publisher) in enumerate(messages):
        due = began + (log_ns - first) * 1e-9 / rate
        while running() and (left := due - time.monotonic()) > 0.0:
            spin_once(left)
        if not running():
            return played
        publisher.publish(data)
    return len(messages)
