# SPDX-License-Identifier: Apache-2.0
"""The difference-model node as the learner sees it: ask for an update, wait for the weights."""

from __future__ import annotations

import time
from typing import Any

from rclpy.node import Node

from leo_diffmodel.difference.model import from_bytes
from leo_learner.robot_env import Stopped
from leo_msgs_py import topics
from leo_msgs_py.errors import UserError
from leo_msgs_py.node import running, spin_once

ASK_AGAIN = 5.0
"""An update is asked for again after this time [s]: the node may have been restarted."""


class DifferenceClient:
    """Waits for weights of a later version, asking until it gets them.

    Args:
        node: joined to the graph; it is served while this waits.
        robot: name of the robot the weights must be of.
    """

    def __init__(self, node: Node, robot: str) -> None:
        self._node, self._robot = node, robot
        self._weights, self._said = b'', ''
        self._version = 0
        weights = topics.DIFFERENCE_WEIGHTS
        node.create_subscription(weights.type, weights.name, self._on_weights, weights.qos)
        self._update = node.create_client(*topics.DIFFERENCE_UPDATE)

    def newer(self, version: int) -> bytes:
        """Weights of a later version than `version`, fitted after this call.

        Raises:
            Stopped: the process was asked to end.
        """
        version = max(version, self._version)
        asked = -ASK_AGAIN
        while self._version <= version:
            if not running():
                raise Stopped
            if time.monotonic() - asked > ASK_AGAIN:
                asked = time.monotonic()
                self._ask()
            spin_once()
        return self._weights

    def _ask(self) -> None:
        if self._update.service_is_ready():
            future = self._update.call_async(topics.DIFFERENCE_UPDATE.type.Request())
            future.add_done_callback(self._on_answer)
        else:
            self._log('waiting for the difference model (leo run leo_diffmodel diffmodel)')

    def _on_answer(self, future: Any) -> None:
        self._log(f'difference model: {future.result().message}')

    def _log(self, text: str) -> None:
        """Say it once, however often it is the answer."""
        if text != self._said:
            self._node.get_logger().info(text)
        self._said = text

    def _on_weights(self, message: Any) -> None:
        data = bytes(message.data)
        try:
            difference = from_bytes(data, topics.DIFFERENCE_WEIGHTS.name)
        except UserError as error:
            self._node.get_logger().error(str(error))
            return
        if difference.robot != self._robot:
            self._log(f'weights for robot {difference.robot!r} ignored, this is {self._robot!r}')
            return
        self._weights, self._version = data, difference.version
