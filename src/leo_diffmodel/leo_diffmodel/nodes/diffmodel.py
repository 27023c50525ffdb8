# SPDX-License-Identifier: Apache-2.0
"""The node between robot and learner: records rollouts, serves the difference model.

leo run leo_diffmodel diffmodel --ros-args -p bag:=runs/rollout
"""

from __future__ import annotations

from functools import partial
from pathlib import Path
from typing import Any, Protocol

from leo_diffmodel.bags.recorder import finish_left_over, recorded, Recorder
from leo_diffmodel.difference.service import DifferenceService, Settings
from leo_diffmodel.nodes.graph_recorder import GraphRecorder
from leo_msgs_py import topics
from leo_msgs_py.cli import executable
from leo_msgs_py.messages import DiagnosticArray, Header
from leo_msgs_py.node import api
from leo_msgs_py.values import time_message

DIAGNOSTICS_PERIOD = 1.0


class Part(Protocol):
    """One thing the node does."""

    def status(self) -> Any:
        """Return its DiagnosticStatus."""

    def close(self) -> None:
        """Finish what is open."""


class DiffModelNode:
    """Composes the parts and reports their status on /diagnostics once a second.

    Parameters:
        bag: folder of the first bag; bag_1, bag_2, ... follow where it exists.
        record: whether to record.
        robot: model to name in the bag where the robot node does not say.
        model: model file or robot the difference model corrects.
        difference: its configuration, recommended, torque, full or thesis.
        repair: name effects first; the difference is learned on top of them.
    """

    def __init__(self, node: Any) -> None:
        self._node = node
        self._base = Path(api.fixed_parameter(node, 'bag', 'runs/rollout'))
        record = api.fixed_parameter(node, 'record', True)
        robot = api.fixed_parameter(node, 'robot', '')
        self._parts: list[Part] = [self._record(robot)] if record else []
        self._parts.append(self._difference())
        self._diagnostics = node.create_publisher(*topics.DIAGNOSTICS)
        api.wall_timer(node, DIAGNOSTICS_PERIOD, self._report)

    def close(self) -> None:
        """Finish what is open."""
        for part in self._parts:
            part.close()

    def _record(self, robot: str) -> GraphRecorder:
        for folder in finish_left_over(self._base):
            self._node.get_logger().info(f'finished {folder}, whose recorder was killed')
        recording = GraphRecorder(self._node, Recorder(self._base), robot)
        recording.add_graph()
        return recording

    def _difference(self) -> DifferenceService:
        settings = Settings(
            model=api.fixed_parameter(self._node, 'model', 'pendulum'),
            bags=partial(recorded, self._base),
            folder=self._base.with_name(f'{self._base.name}.difference'),
            config=api.fixed_parameter(self._node, 'difference', 'recommended'),
            repair=api.fixed_parameter(self._node, 'repair', False),
        )
        return DifferenceService(self._node, settings)

    def _report(self) -> None:
        header = Header(stamp=time_message(self._node.get_clock().now().nanoseconds))
        status = [part.status() for part in self._parts]
        self._diagnostics.publish(DiagnosticArray(header=header, status=status))


@executable
def main(argv: list[str]) -> int:
    """Run the node until SIGINT or SIGTERM."""
    node = api.create_node('diffmodel', argv)
    diffmodel = DiffModelNode(node)
    try:
        api.spin(node)
    finally:
        diffmodel.close()
        node.destroy_node()
        api.shutdown()
    return 0
