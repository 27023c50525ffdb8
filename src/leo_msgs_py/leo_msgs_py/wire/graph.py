# SPDX-License-Identifier: Apache-2.0
"""The ROS graph: what `ros_discovery_info` and DDS discovery together say about nodes."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any

from cyclonedds.builtin import (
    BuiltinDataReader,
    BuiltinTopicDcpsParticipant,
    BuiltinTopicDcpsPublication,
    BuiltinTopicDcpsSubscription,
)
from cyclonedds.core import InstanceState

from leo_msgs_py.qos import DurabilityPolicy, HistoryPolicy, QoSProfile
from leo_msgs_py.wire import qos
from leo_msgs_py.wire.participant import Participant
from leo_msgs_py.wire.types import deserialize, Message, message_class, serialize

_TOPIC = 'ros_discovery_info'
_INFO = 'rmw_dds_common/msg/ParticipantEntitiesInfo'
_WRITER_QOS = QoSProfile(depth=1, durability=DurabilityPolicy.TRANSIENT_LOCAL)
_READER_QOS = QoSProfile(
    history=HistoryPolicy.KEEP_ALL, durability=DurabilityPolicy.TRANSIENT_LOCAL
)
_MOST = 100_000


@dataclass
class NodeEntry:
    """A node and its endpoints.

    Attributes:
        namespace: '/' or '/a/b'.
        name: node name.
        readers: GIDs (16 bytes, network order) of its readers.
        writers: GIDs of its writers.
    """

    namespace: str
    name: str
    readers: list[bytes] = field(default_factory=list)
    writers: list[bytes] = field(default_factory=list)

    @property
    def full_name(self) -> str:
        """'/a/b/name'."""
        return f'{self.namespace.rstrip("/")}/{self.name}'


@dataclass(frozen=True)
class Endpoint:
    """A discovered writer or reader.

    Attributes:
        topic: DDS topic name.
        type: DDS type name.
        gid: its GUID, 16 bytes in network order.
        profile: quality of service.
        user_data: type hash, client or service id.
    """

    topic: str
    type: str
    gid: bytes
    profile: QoSProfile
    user_data: dict[str, str]


class Graph:
    """Publishes this participant's nodes and knows everybody's.

    Args:
        participant: the participant; the graph's own endpoints belong to it, not to a node.
    """

    def __init__(self, participant: Participant) -> None:
        self._gid = participant.gid
        self._nodes: list[NodeEntry] = []
        self._others: dict[bytes, list[NodeEntry]] = {}
        self._writer = participant.writer(_TOPIC, _INFO, _WRITER_QOS)
        self.reader = participant.reader(_TOPIC, _INFO, _READER_QOS)
        self._participants, self._writers, self._readers = (
            BuiltinDataReader(participant.entity, topic)
            for topic in (
                BuiltinTopicDcpsParticipant,
                BuiltinTopicDcpsPublication,
                BuiltinTopicDcpsSubscription,
            )
        )

    def add_node(self, namespace: str, name: str) -> NodeEntry:
        """Announce a node; call `publish` after changing its endpoints."""
        node = NodeEntry(namespace, name)
        self._nodes.append(node)
        self.publish()
        return node

    def remove_node(self, node: NodeEntry) -> None:
        """Announce that a node is gone."""
        self._nodes.remove(node)
        self.publish()

    def publish(self) -> None:
        """Send the whole state, as each change has to."""
        info = message_class(_INFO)(gid=_gid(self._gid))
        info.node_entities_info_seq = [_entry_message(node) for node in self._nodes]
        self._writer.write(serialize(info))

    def take(self) -> None:
        """Read what others announced since the last call."""
        for sample in self.reader.take(1000):
            info: Any = deserialize(sample.data, _INFO)
            gid = info.gid.data.tobytes()
            if gid != self._gid:
                self._others[gid] = [_entry(node) for node in info.node_entities_info_seq]

    def nodes(self) -> list[NodeEntry]:
        """All nodes of living participants, this one's first."""
        self.take()
        alive = {sample.key.bytes for sample in _alive(self._participants)}
        self._others = {gid: nodes for gid, nodes in self._others.items() if gid in alive}
        return self._nodes + [node for nodes in self._others.values() for node in nodes]

    def writers(self) -> list[Endpoint]:
        """All living writers of the domain, this participant's included."""
        return [_endpoint(sample) for sample in _alive(self._writers)]

    def readers(self) -> list[Endpoint]:
        """All living readers of the domain, this participant's included."""
        return [_endpoint(sample) for sample in _alive(self._readers)]


def _alive(reader: BuiltinDataReader) -> list[Any]:
    samples: list[Any] = reader.read(_MOST)
    return [s for s in samples if s.sample_info.instance_state == InstanceState.Alive]


def _endpoint(sample: Any) -> Endpoint:
    return Endpoint(
        topic=sample.topic_name,
        type=sample.type_name,
        gid=sample.key.bytes,
        profile=qos.as_profile(sample.qos),
        user_data=qos.user_data(sample.qos),
    )


def _gid(data: bytes) -> Message:
    return message_class('rmw_dds_common/msg/Gid')(data=data)


def _entry_message(node: NodeEntry) -> Message:
    return message_class('rmw_dds_common/msg/NodeEntitiesInfo')(
        node_namespace=node.namespace,
        node_name=node.name,
        reader_gid_seq=[_gid(gid) for gid in node.readers],
        writer_gid_seq=[_gid(gid) for gid in node.writers],
    )


def _entry(message: Any) -> NodeEntry:
    return NodeEntry(
        namespace=message.node_namespace,
        name=message.node_name,
        readers=[gid.data.tobytes() for gid in message.reader_gid_seq],
        writers=[gid.data.tobytes() for gid in message.writer_gid_seq],
    )
