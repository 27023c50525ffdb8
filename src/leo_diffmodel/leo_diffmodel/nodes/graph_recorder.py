# SPDX-License-Identifier: Apache-2.0
"""Recording the graph: serialized messages taken from subscriptions into a `Recorder`."""

from __future__ import annotations

from collections.abc import Sequence
from importlib.util import find_spec
import math
from operator import itemgetter
import time
from typing import Any, TYPE_CHECKING

from diagnostic_msgs.msg import DiagnosticStatus
from rclpy.node import Node
from rclpy.qos import HistoryPolicy, QoSProfile
from rclpy.subscription import Subscription

from leo_diffmodel.bags.arrival import ArrivalTimes
from leo_diffmodel.bags.recorder import Recorder, TWO
from leo_diffmodel.bags.types import definition, to_yaml, Topic
from leo_diffmodel.nodes.robot_facts import RobotFacts
from leo_msgs_py import topics
from leo_msgs_py.interfaces import load
from leo_msgs_py.node import every
from leo_msgs_py.serialized import taken
from leo_msgs_py.values import status_message

if TYPE_CHECKING:
    from leo_diffmodel.watch.live.buffer import MessageBuffer

TAKE_PERIOD = 0.02
FLUSH_PERIOD = 0.1
FACTS_PERIOD = 0.25
QUIET = 0.3  # s without an old message after which none is on its way
STILL = 1.0  # s without a look after which this process must have stood still
FOUND = 3.0  # s in which it then finds the publishers again
DRAINED = 5.0  # s that it takes at most to get what is on its way

GRAPH_TOPICS = (
    topics.JOINT_STATES,
    *topics.APPLIED.values(),
    *topics.COMMANDS.values(),
    topics.EPISODE,
    topics.E_STOPPED,
    topics.ROBOT_DESCRIPTION,
    topics.CLOCK,
    topics.SUPPLY,
    topics.CURRENT,
    topics.TEMPERATURE,
)
"""What is recorded unless topics are named."""

DYNAMIC_JOINT_STATES = '/dynamic_joint_states', 'control_msgs/msg/DynamicJointState'
"""What a ros2_control robot publishes; recorded where control_msgs is installed."""


class GraphRecorder:
    """Records topics with everything that is published on them.

    Its subscriptions keep all messages, belong to a node that no executor serves, and are emptied
    by a timer of `node`: in Python that takes a tenth of the time of a callback for each message,
    and gives the time at which each was published. The node's name and remappings are used.

    `robot` is the model for the `leo` record where the robot node does not answer. Nothing is ever
    lost, except where so many of the `newest` will do: then no publisher waits for this reader.
    """

    def __init__(
        self, node: Node, recorder: Recorder | MessageBuffer, robot: str = '', newest: int = 0
    ) -> None:
        self._node = node
        self._kept: Any = {'depth': newest} if newest else {'history': HistoryPolicy.KEEP_ALL}
        self._recorder = recorder
        self._facts = RobotFacts(node, robot)
        self._times = ArrivalTimes()
        self._taken, self._found = time.monotonic(), 0.0
        self._said: Any = None
        self._troubles: list[str] = []
        self._strangers, self._warned = 0, False
        recorder.publishers = self._publishers
        self._ears = Node(
            f'{node.get_name()}_recorder',
            namespace=node.get_namespace(),
            enable_rosout=False,
            use_global_arguments=False,
            start_parameter_services=False,
        )
        self._subscriptions: list[tuple[Topic, Subscription]] = []
        periods = TAKE_PERIOD, FLUSH_PERIOD, FACTS_PERIOD
        actions = self._take, self._flush, self._describe
        self._timers = [every(node, p, act) for p, act in zip(periods, actions, strict=True)]

    def add_graph(self) -> None:
        for topic in GRAPH_TOPICS:
            self.add(topic)
        if find_spec('control_msgs'):
            name, type_text = DYNAMIC_JOINT_STATES
            self.add_named(name, type_text, topics.JOINT_STATES.qos)

    def add(self, topic: topics.Topic) -> None:
        package, kind, *_ = topic.type.__module__.split('.')
        self.add_named(topic.name, f'{package}/{kind}/{topic.type.__name__}', topic.qos)

    def add_named(self, name: str, type_text: str, qos: QoSProfile) -> None:
        """Record a topic, remapped as the node's are, of a type as `sensor_msgs/msg/JointState`.

        UserError: the type is not installed, or its definition not known.
        """
        name = self._node.resolve_topic_name(name)
        definition(type_text)  # says now, not at the first message, that it cannot be written
        policies = (p.name.lower() for p in (qos.reliability, qos.durability))
        offered = to_yaml(qos.history.name.lower(), qos.depth, *policies)
        kept = QoSProfile(**self._kept, durability=qos.durability, reliability=qos.reliability)
        kind = load(type_text)
        subscription = self._ears.create_subscription(kind, name, lambda _: None, kept, raw=True)
        self._subscriptions.append((Topic(name, type_text, offered), subscription))

    def status(self) -> DiagnosticStatus:
        recorder = self._recorder
        level, text = self._health()
        values = {
            'bag': recorder.folder or '',
            'size_bytes': recorder.size,
            'messages': recorder.messages,
            'lost': recorder.lost,
            'of another robot': recorder.foreign,
        }
        return status_message(f'{self._node.get_name()}: recording', level, text, values)

    def _health(self) -> tuple[bytes, str]:
        recorder = self._recorder
        if troubles := recorder.troubles:
            level = DiagnosticStatus.ERROR if recorder.full else DiagnosticStatus.WARN
            return level, '; '.join(troubles)
        if recorder.folder is None:
            return DiagnosticStatus.OK, 'waiting for the first message'
        return DiagnosticStatus.OK, f'recording {recorder.folder}'

    def close(self) -> None:
        for timer in self._timers:
            self._node.destroy_timer(timer)
        self._drain()
        self._ears.destroy_node()
        self._recorder.close()

    def _drain(self) -> None:
        """Take what is on its way; a process that stood still receives it only now."""
        ended, began = time.time_ns(), time.monotonic()
        self._take()
        until = max(began + QUIET, self._found)
        while time.monotonic() < min(until, began + DRAINED):
            if (oldest := self._take()) < math.inf:
                choose = max if oldest < ended else min
                until = choose(until, time.monotonic() + QUIET)
            time.sleep(TAKE_PERIOD)

    def _take(self) -> float:
        """Record what has arrived; return when the oldest of it was published [ns]."""
        before, self._taken = self._taken, time.monotonic()
        if self._taken - before > STILL:
            self._found = self._taken + FOUND
        self._times.begin()
        found = [(topic, m) for topic, waiting in self._subscriptions for m in taken(waiting)]
        self._times.end()
        logged = [self._times.logged(m.received_ns or m.published_ns) for _, m in found]
        for logged_ns, (topic, m) in sorted(zip(logged, found, strict=True), key=itemgetter(0)):
            self._recorder.record(topic, m.data, m.published_ns, logged_ns, m.number, m.publisher)
        return min((m.published_ns for _, m in found), default=math.inf)

    def _publishers(self, topic: str) -> set[bytes]:
        return {bytes(p.endpoint_gid) for p in self._ears.get_publishers_info_by_topic(topic)}

    def _flush(self) -> None:
        self._recorder.flush()
        if self._recorder.folder != self._said:
            self._said = self._recorder.folder
            self._node.get_logger().info(f'recording {self._said}')
        self._log(self._recorder.troubles)

    def _log(self, troubles: Sequence[str]) -> None:
        strangers = self._recorder.strangers
        known = [*self._troubles, *([TWO] if strangers == self._strangers else [])]
        fresh = [text for text in troubles if text not in known]
        for text in fresh:
            self._node.get_logger().warning(text)
        self._warned = self._warned or bool(fresh)
        if self._warned and not troubles:
            lost, foreign = self._recorder.lost, self._recorder.foreign
            left_out = f'{lost} messages lost, {foreign} of another robot left out'
            self._node.get_logger().info(f'recording {self._said} again, {left_out}')
            self._warned = False
        self._troubles, self._strangers = [*troubles], strangers

    def _describe(self) -> None:
        if facts := self._facts.poll():
            self._recorder.describe(facts)
