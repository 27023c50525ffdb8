# SPDX-License-Identifier: Apache-2.0
"""`leo bag record`: topics of the graph into a bag until Ctrl-C."""

from collections.abc import Sequence
from datetime import datetime
from pathlib import Path

from rclpy.node import Node

from leo_diffmodel.bags.recorder import Recorder
from leo_diffmodel.nodes.graph_recorder import GRAPH_TOPICS, GraphRecorder
from leo_msgs_py.errors import UserError
from leo_msgs_py.node import every, graph, spin
from leo_msgs_py.terminal import leo

LOOK_PERIOD = 0.5


def record(names: Sequence[str], folder: Path | None, ros_args: list[str]) -> Recorder:
    """Record topics until SIGINT or SIGTERM. No names: the graph's.

    Without a folder a dated one is made; UserError where it exists, or nothing was published.
    """
    if folder is not None and folder.exists():
        raise UserError(f'{folder} exists already; choose another folder')
    base = folder or Path(f'{datetime.now():rosbag2_%Y_%m_%d-%H_%M_%S}')
    with graph(ros_args):
        node = Node('recorder')
        recorder = Recorder(base)
        recording = GraphRecorder(node, recorder)
        wanted = _Wanted(node, recording, names)
        try:
            spin(node)
        finally:
            recording.close()
    if recorder.folder is None:
        missing = f'; never seen: {", ".join(wanted.missing)}' if wanted.missing else ''
        raise UserError(f'nothing was published, so there is no bag{missing}')
    return recorder


def told(recorded: Recorder) -> list[str]:
    lost = f', {recorded.lost} lost' if recorded.lost else ''
    foreign = f', {recorded.foreign} of another robot left out' if recorded.foreign else ''
    return [
        f'wrote {recorded.folder}: {recorded.messages} messages{lost}{foreign}',
        f'next: {leo("bag", "info", recorded.folder)}',
    ]


class _Wanted:
    """Named topics, subscribed to as soon as their type is known; the graph's where none is."""

    def __init__(self, node: Node, recording: GraphRecorder, names: Sequence[str]) -> None:
        self._node = node
        self._recording = recording
        self.missing = [node.resolve_topic_name(name) for name in names]
        if not names:
            recording.add_graph()
        for topic in GRAPH_TOPICS:
            if (name := node.resolve_topic_name(topic.name)) in self.missing:
                self.missing.remove(name)
                recording.add(topic)
        if self.missing:
            node.get_logger().info(f'waiting for {", ".join(self.missing)}')
            every(node, LOOK_PERIOD, self._look)

    def _look(self) -> None:
        for name in list(self.missing):
            if offers := self._node.get_publishers_info_by_topic(name):
                self.missing.remove(name)
                try:
                    self._recording.add_named(name, offers[0].topic_type, offers[0].qos_profile)
                except UserError as error:
                    self._node.get_logger().error(f'{name} is not recorded: {error}')
