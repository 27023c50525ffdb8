# SPDX-License-Identifier: Apache-2.0
"""What the learner node says about itself on /diagnostics."""

from __future__ import annotations

from typing import Any

from leo_learner.algorithm5 import Done
from leo_msgs_py import topics
from leo_msgs_py.messages import DiagnosticArray, DiagnosticStatus, Header, KeyValue
from leo_msgs_py.node import api
from leo_msgs_py.values import time_message

PERIOD = 1.0
"""Time between two reports [s]; while a policy trains, the episode under way ends first."""


class Status:
    """Logs what is being done, and repeats it on /diagnostics once a second.

    Args:
        node: of the node layer.

    Attributes:
        done: how far the run is; None before it begins.
    """

    def __init__(self, node: Any) -> None:
        self._node, self._said = node, 'starting'
        self.done: Done | None = None
        self._publisher = node.create_publisher(*topics.DIAGNOSTICS)
        api.wall_timer(node, PERIOD, self._report)

    def say(self, text: str) -> None:
        """Log one line; it is the message of the reports until the next."""
        self._said = text
        self._node.get_logger().info(text)

    def _report(self) -> None:
        header = Header(stamp=time_message(self._node.get_clock().now().nanoseconds))
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
