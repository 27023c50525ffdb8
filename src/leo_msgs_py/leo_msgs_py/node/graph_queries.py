# SPDX-License-Identifier: Apache-2.0
"""Questions about the graph, under rclpy's names, answered from DDS discovery."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from dataclasses import dataclass

from leo_msgs_py.qos import QoSProfile
from leo_msgs_py.wire import names
from leo_msgs_py.wire.graph import Endpoint, Graph, NodeEntry

NamesAndTypes = list[tuple[str, list[str]]]
_UNKNOWN = '_NODE_NAME_UNKNOWN_'


@dataclass(frozen=True)
class TopicEndpointInfo:
    """A publisher or subscription of a topic and the node it belongs to."""

    node_name: str
    node_namespace: str
    topic_type: str
    topic_type_hash: str
    endpoint_type: str
    endpoint_gid: list[int]
    qos_profile: QoSProfile


class GraphQueries:
    """What a node can ask about all nodes, topics and services it has discovered."""

    def __init__(self, graph: Graph) -> None:
        self._graph = graph

    def get_node_names_and_namespaces(self) -> list[tuple[str, str]]:
        """(name, namespace) of every node."""
        return [(node.name, node.namespace) for node in self._graph.nodes()]

    def get_topic_names_and_types(self) -> NamesAndTypes:
        """Every topic with its types, sorted."""
        return _topics([*self._graph.writers(), *self._graph.readers()])

    def get_service_names_and_types(self) -> NamesAndTypes:
        """Every service with its types, sorted."""
        return _services([*self._graph.writers(), *self._graph.readers()])

    def get_publishers_info_by_topic(self, topic: str) -> list[TopicEndpointInfo]:
        """Publishers of an absolute topic name."""
        return self._infos(topic, self._graph.writers(), 'PUBLISHER')

    def get_subscriptions_info_by_topic(self, topic: str) -> list[TopicEndpointInfo]:
        """Subscriptions of an absolute topic name."""
        return self._infos(topic, self._graph.readers(), 'SUBSCRIPTION')

    def get_publisher_names_and_types_by_node(self, node: str, namespace: str) -> NamesAndTypes:
        """Topics a node publishes."""
        return _topics(_owned(self._graph.writers(), self._entries(node, namespace)))

    def get_subscriber_names_and_types_by_node(self, node: str, namespace: str) -> NamesAndTypes:
        """Topics a node subscribes to."""
        return _topics(_owned(self._graph.readers(), self._entries(node, namespace)))

    def get_service_names_and_types_by_node(self, node: str, namespace: str) -> NamesAndTypes:
        """Services a node serves: it reads their requests."""
        endpoints = _owned(self._graph.readers(), self._entries(node, namespace))
        return _services(e for e in endpoints if e.topic.startswith('rq/'))

    def get_client_names_and_types_by_node(self, node: str, namespace: str) -> NamesAndTypes:
        """Services a node calls: it reads their replies."""
        endpoints = _owned(self._graph.readers(), self._entries(node, namespace))
        return _services(e for e in endpoints if e.topic.startswith('rr/'))

    def count_publishers(self, topic: str) -> int:
        """How many publishers an absolute topic name has."""
        return len(self.get_publishers_info_by_topic(topic))

    def count_subscribers(self, topic: str) -> int:
        """How many subscriptions an absolute topic name has."""
        return len(self.get_subscriptions_info_by_topic(topic))

    def _entries(self, node: str, namespace: str) -> list[NodeEntry]:
        return [n for n in self._graph.nodes() if (n.name, n.namespace) == (node, namespace)]

    def _infos(self, topic: str, endpoints: list[Endpoint], kind: str) -> list[TopicEndpointInfo]:
        owners = {g: n for n in self._graph.nodes() for g in (*n.readers, *n.writers)}
        dds = names.topic_to_dds(topic)
        return [_info(e, owners.get(e.gid), kind) for e in endpoints if e.topic == dds]


def _info(endpoint: Endpoint, node: NodeEntry | None, kind: str) -> TopicEndpointInfo:
    return TopicEndpointInfo(
        node_name=node.name if node else _UNKNOWN,
        node_namespace=node.namespace if node else _UNKNOWN,
        topic_type=names.type_from_dds(endpoint.type) or endpoint.type,
        topic_type_hash=endpoint.user_data.get('typehash', 'INVALID'),
        endpoint_type=kind,
        endpoint_gid=list(endpoint.gid),
        qos_profile=endpoint.profile,
    )


def _owned(endpoints: list[Endpoint], nodes: list[NodeEntry]) -> list[Endpoint]:
    gids = {gid for node in nodes for gid in (*node.readers, *node.writers)}
    return [endpoint for endpoint in endpoints if endpoint.gid in gids]


def _topics(endpoints: Iterable[Endpoint]) -> NamesAndTypes:
    return _collect(endpoints, names.topic_from_dds, names.type_from_dds)


def _services(endpoints: Iterable[Endpoint]) -> NamesAndTypes:
    return _collect(endpoints, names.service_from_dds, names.service_type_from_dds)


def _collect(
    endpoints: Iterable[Endpoint],
    name_of: Callable[[str], str | None],
    type_of: Callable[[str], str | None],
) -> NamesAndTypes:
    found: dict[str, set[str]] = {}
    for endpoint in endpoints:
        name, kind = name_of(endpoint.topic), type_of(endpoint.type)
        if name and kind:
            found.setdefault(name, set()).add(kind)
    return [(name, sorted(kinds)) for name, kinds in sorted(found.items())]
