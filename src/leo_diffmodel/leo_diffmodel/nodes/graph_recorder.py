# SPDX-License-Identifier: Apache-2.0
"""Recording the graph from a node: raw subscriptions into a `Recorder`."""

from __future__ import annotations

from collections.abc import Mapping
from functools import partial
from typing import Any

from leo_diffmodel.bags.qos_text import to_yaml
from leo_diffmodel.bags.recorder import RecordedTopic, Recorder
from leo_diffmodel.nodes.robot_facts import RobotFacts
from leo_msgs_py import topics
from leo_msgs_py.messages import DiagnosticStatus, KeyValue, load
from leo_msgs_py.node import api
from leo_msgs_py.qos import DurabilityPolicy, QoSProfile
from leo_msgs_py.topics import Topic
from leo_msgs_py.wire.types import type_name

DEPTH = 1000
FLUSH_PERIOD = 0.1
FACTS_PERIOD = 0.25

GRAPH_TOPICS = (
    topics.JOINT_STATES, topics.DYNAMIC_JOINT_STATES, topics.VOLTAGE_COMMANDS,
    topics.EFFORT_COMMANDS, topics.EPISODE, topics.E_STOPPED, topics.ROBOT_DESCRIPTION,
    topics.CLOCK,
)
"""What is recorded unless topics are named."""


class GraphRecorder:
    """Subscribes a node to topics and records them, flushing and asking for facts on timers.

    Args:
        node: of the node layer.
        recorder: takes the bytes.
        robot: model for the `leo` record where the robot node does not answer.
    """

    def __init__(self, node: Any, recorder: Recorder, robot: str = '') -> None:
        self._node = node
        self._recorder = recorder
        self._facts = RobotFacts(node, robot)
        self._said: Any = None
        api.wall_timer(node, FLUSH_PERIOD, self._flush)
        api.wall_timer(node, FACTS_PERIOD, self._describe)

    def add_graph(self) -> None:
        """Record the graph's topics."""
        for topic in GRAPH_TOPICS:
            self.add(topic)

    def add(self, topic: Topic) -> None:
        """Record a topic of the graph's table."""
        name = self._node.resolve_topic_name(topic.name)
        self._subscribe(name, topic.type, topic.qos)

    def add_named(self, name: str, type_text: str, qos: QoSProfile) -> None:
        """Record a topic found in the graph.

        Args:
            name: absolute.
            type_text: as `sensor_msgs/msg/JointState`.
            qos: what its publisher offers.

        Raises:
            UserError: the type is not known here.
        """
        self._subscribe(name, load(type_text), qos)

    def status(self) -> Any:
        """Return the DiagnosticStatus of the bag being written."""
        folder = self._recorder.folder
        return DiagnosticStatus(
            level=DiagnosticStatus.OK, name=f'{self._node.get_name()}: recording',
            message=f'recording {folder}' if folder else 'waiting for the first message',
            values=[
                KeyValue(key='bag', value=str(folder or '')),
                KeyValue(key='size_bytes', value=str(self._recorder.size)),
                KeyValue(key='messages', value=str(self._recorder.messages)),
            ],
        )

    def close(self) -> None:
        """Finish the bag."""
        self._recorder.close()

    def _subscribe(self, name: str, message_type: Any, qos: QoSProfile) -> None:
        latched = qos.durability == DurabilityPolicy.TRANSIENT_LOCAL
        type_text = _type_text(message_type)
        recorded = RecordedTopic(name, type_text, to_yaml(qos), latched)
        self._node.create_subscription(
            message_type, name, partial(self._record, recorded), reading(qos), raw=True
        )

    def _record(self, topic: RecordedTopic, data: bytes, info: Mapping[str, Any]) -> None:
        self._recorder.record(topic, data, info['source_timestamp'])

    def _flush(self) -> None:
        self._recorder.flush()
        if self._recorder.folder != self._said:
            self._said = self._recorder.folder
            self._node.get_logger().info(f'recording {self._said}')

    def _describe(self) -> None:
        facts = self._facts.poll()
        if facts:
            self._recorder.describe(facts)


def reading(qos: QoSProfile) -> QoSProfile:
    """Return what to subscribe with: as offered, but deep enough to lose nothing."""
    return QoSProfile(
        depth=max(qos.depth, DEPTH),
        durability=qos.durability,
        reliability=qos.reliability,
    )


def _type_text(message_type: Any) -> str:
    """Return `pkg/msg/Name` of our classes and of the generated ROS ones."""
    if hasattr(message_type, '__msgtype__'):
        return type_name(message_type)
    package = message_type.__module__.split('.')[0]
    return f'{package}/msg/{message_type.__name__}'
