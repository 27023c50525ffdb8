# SPDX-License-Identifier: Apache-2.0
"""The node between robot and learner: records rollouts, serves the difference model.

leo run leo_diffmodel diffmodel --ros-args -p bag:=runs/rollout
"""

from functools import partial
from pathlib import Path

from diagnostic_msgs.msg import DiagnosticArray
from rclpy.node import Node
from std_msgs.msg import Header

from leo_diffmodel.bags.finish import finish_left_over, recorded
from leo_diffmodel.bags.recorder import Recorder
from leo_diffmodel.difference.service import DifferenceService, Settings
from leo_diffmodel.nodes.graph_recorder import GraphRecorder
from leo_msgs_py import topics
from leo_msgs_py.cli import executable
from leo_msgs_py.node import every, fixed_parameter, graph, private_parameter, spin
from leo_sim.common.consent import trust_parameter

DIAGNOSTICS_PERIOD = 1.0


class DiffModelNode(Node):
    """Composes the parts and reports their status on /diagnostics once a second.

    Parameters:
        bag: folder of the first bag; bag_1, bag_2, ... follow where it exists.
        record: whether to record.
        robot: model to name in the bag where the robot node does not say.
        model: model file or robot the difference model corrects.
        difference: its configuration, recommended, torque, full or thesis.
        effect: Python file of an effect that the model names and that may run, or a list of them.
        repair: name effects first; the difference is learned on top of them.
    """

    def __init__(self) -> None:
        super().__init__('diffmodel')
        self._base = Path(fixed_parameter(self, 'bag', 'runs/rollout'))
        record = fixed_parameter(self, 'record', True)
        robot = fixed_parameter(self, 'robot', '')
        difference = self._difference()  # may refuse its model, and then nothing is recorded
        self._parts: list[GraphRecorder | DifferenceService] = [difference]
        if record:
            self._parts.insert(0, self._record(robot))
        self._diagnostics = self.create_publisher(*topics.DIAGNOSTICS)
        every(self, DIAGNOSTICS_PERIOD, self._report)

    def close(self) -> None:
        for part in self._parts:
            part.close()

    def _record(self, robot: str) -> GraphRecorder:
        for folder in finish_left_over(self._base):
            self.get_logger().info(f'finished {folder}, whose recorder was killed')
        recording = GraphRecorder(self, Recorder(self._base), robot)
        recording.add_graph()
        return recording

    def _difference(self) -> DifferenceService:
        trust_parameter(private_parameter(self, 'effect', ['']))
        settings = Settings(
            model=fixed_parameter(self, 'model', 'pendulum'),
            bags=partial(recorded, self._base),
            folder=self._base.with_name(f'{self._base.name}.difference'),
            config=fixed_parameter(self, 'difference', 'recommended'),
            repair=fixed_parameter(self, 'repair', False),
        )
        return DifferenceService(self, settings)

    def _report(self) -> None:
        header = Header(stamp=self.get_clock().now().to_msg())
        status = [part.status() for part in self._parts]
        self._diagnostics.publish(DiagnosticArray(header=header, status=status))


@executable
def main(argv: list[str]) -> int:
    with graph(argv):
        node = DiffModelNode()
        try:
            spin(node)
        finally:
            node.close()
    return 0
