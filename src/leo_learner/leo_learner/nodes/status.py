# SPDX-License-Identifier: Apache-2.0
"""What the learner node says about itself on /diagnostics."""

from __future__ import annotations

from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus, KeyValue
from rclpy.clock import Clock, ClockType
from rclpy.node import Node
from std_msgs.msg import Header

from leo_learner.algorithm5 import Done
from leo_msgs_py import topics

PERIOD = 1.0
"""Time between two reports [s]; while a policy trains, the episode under way ends first."""


class Status:
    """Logs what is being done, and repeats it on /diagnostics once a second.

    Args:
        node: the learner.

    Attributes:
        done: how far the run is; None before it begins.
    """

    def __init__(self, node: Node) -> None:
        self._node, self._said = node, 'starting'
        self.done: Done | None = None
        self._publisher = node.create_publisher(*topics.DIAGNOSTICS)
        node.create_timer(PERIOD, self._report, clock=Clock(clock_type=ClockType.STEADY_TIME))

    def say(self, text: str) -> None:
        """Log one line; it is the message of the reports until the next."""
        self._said = text
        self._node.get_logger().info(text)

    def _report(self) -> None:
        header = Header(stamp=self._node.get_clock().now().to_msg())
        status = DiagnosticStatus(
            level=DiagnosticStatus.OK, name=f'{self._node.get_name()}: learning',
            message=self._said, values=[KeyValue(key=k, value=v) for k, v in self._values()],
        )
        self._publisher.publish(DiagnosticArray(header=header, status=[status]))

    def _values(self) -> list[tuple[str, str]]:
        if self.done is None:
            return []
        returns = ', '.join(f'{r:.1f}' for r in self.done.tests)
        return [
            ('round', str(self.done.update)),
            ('phase', self.done.phase),
            ('difference model version', str(self.done.version)),
            ('returns on the robot', returns or 'none yet'),
            ('round that drives the robot', str(self.done.driver)),
            ('steps on the robot', str(self.done.samples)),
        ]
