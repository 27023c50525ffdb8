# SPDX-License-Identifier: Apache-2.0
"""`leo bag record`: topics of the graph into a bag until Ctrl-C."""

from __future__ import annotations

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


def record(names: Sequence[str], folder: Path | None, ros_args: list[str]) -> int:
    """Record topics until SIGINT or SIGTERM; 1 where messages were lost. No names: the graph's.

    Without a folder a dated one is made; UserError where it exists.
    """
    if folder is not None and folder.exists():
        raise UserError(f'{folder} exists already; choose another folder')
    base = folder or Path(f'{datetime.now():rosbag2_%Y_%m_%d-%H_%M_%S}')
    with graph(ros_args):
        node = Node('recorder')
        recorder = Recorder(base)
        recording = GraphRecorder(node, recorder)
        wanted = _Wanted(node, recording, names) if names else None
        if wanted is None:
            recording.add_graph()
        try:
            spin(node)
        finally:
            recording.close()
    _report(recorder, wanted)
    return 1 if recorder.lost else 0


def _report(recorder: Recorder, wanted: _Wanted | None) -> None:
    if recorder.folder is None:
        missing = f'; never seen: {", ".join(wanted.missing)}' if wanted and wanted.missing else ''
        raise UserError(f'nothing was published, so there is no bag{missing}')
    lost = f', {recorder.lost} lost' if recorder.lost else ''
    foreign = f', {recorder.foreign} of another robot left out' if recorder.foreign else ''
    print(f'wrote {recorder.folder}: {recorder.messages} messages{lost}{foreign}')
    print(f'next: {leo("bag", "info", recorder.folder)}')


class _Wanted:
    """Named topics, subscribed to as soon as their type is known."""

    def __init__(self, node: Node, recording: GraphRecorder, names: Sequence[str]) -> None:
        self._node = node
        self._recording = recording
        self.missing = [node.resolve_topic_name(name) for name in names]
        for topic in GRAPH_TOPICS:
            if self._found(node.resolve_topic_name(topic.name)):
                recording.add(topic)
        if self.missing:
            node.get_logger().info(f'waiting for {", ".join(self.missing)}')
            every(node, LOOK_PERIOD, self._look)

    def _found(self, name: str) -> bool:
        if name in self.missing:
            self.missing.remove(name)
            return True
        return False

    def _look(self) -> None:
        for name in list(self.missing):
            publishers = self._node.get_publishers_info_by_topic(name)
            if publishers:
                self.missing.remove(name)
                offered = publishers[0]
                try:
                    self._recording.add_named(name, offered.topic_type, offered.qos_profile)
                except UserError as error:
                    self._node.get_logger().error(f'{name} is not recorded: {error}')
