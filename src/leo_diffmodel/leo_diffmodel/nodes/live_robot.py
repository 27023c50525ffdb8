# SPDX-License-Identifier: Apache-2.0
"""A running robot for the live page: its last messages, how it is, and its e-stop."""

from collections.abc import Iterator
from contextlib import closing, contextmanager
import os
from queue import Empty, SimpleQueue
from typing import Any

from rclpy.node import Node

from leo_diffmodel.nodes.graph_recorder import GraphRecorder
from leo_diffmodel.watch.live.buffer import Condition, MessageBuffer
from leo_msgs_py import topics
from leo_msgs_py.node import graph, listen, served_apart

LOOK = 0.1  # longest time between two looks at what came [s]
ROBOT = 'robot'  # how a robot node is called
UNHEARD = 'no {} service answers: stop the robot at its own switch'
PATIENCE = 1.0  # how long an answer to the e-stop is waited for [s]


class LiveRobot:
    """Listens to a robot, in a thread of its own.

    Attributes:
        weights: of the difference model, as latched last; b'' where there are none.
        asked: why the last e-stop or release did not reach the robot; '' where it did, and
            where the robot has said since whether it is stopped.
    """

    def __init__(self, node: Node, buffer: MessageBuffer) -> None:
        self.buffer, self.condition = buffer, Condition()
        self.weights, self.asked = b'', ''
        self._name = f'{node.get_namespace().rstrip("/")}/{ROBOT}'
        self._recording = GraphRecorder(node, buffer, newest=1000)
        self._recording.add_graph()
        self._stop = node.create_client(*topics.E_STOP)
        self._release = node.create_client(*topics.E_STOP_RESET)
        listen(node, topics.E_STOPPED, self._on_stopped)
        listen(node, topics.DIAGNOSTICS, self._on_diagnostics)
        listen(node, topics.DIFFERENCE_WEIGHTS, self._on_weights)

    def e_stop(self) -> SimpleQueue[str]:
        """Stop the robot; sent at once, the answer comes to `asked` and to the queue."""
        return self._ask(self._stop)

    def stopped(self) -> str:
        """Stop the robot and wait for its answer; why it is not known to have stopped, or ''."""
        try:
            return self.e_stop().get(timeout=PATIENCE)
        except Empty:
            return UNHEARD.format(self._stop.service_name)

    def release(self) -> None:
        self._ask(self._release)

    def close(self) -> None:
        self._recording.close()

    def _ask(self, client: Any) -> SimpleQueue[str]:
        """Call a service without waiting for it, even where none has answered so far."""
        answered = SimpleQueue[str]()
        self.asked = '' if client.service_is_ready() else UNHEARD.format(client.service_name)

        def take(future: Any) -> None:
            said = '' if future.result().success else future.result().message
            self.asked = said
            answered.put(said)

        client.call_async(topics.E_STOP.type.Request()).add_done_callback(take)
        return answered

    def _on_stopped(self, message: Any) -> None:
        self.condition.e_stopped, self.asked = bool(message.data), ''

    def _on_diagnostics(self, message: Any) -> None:
        for status in message.status:
            if status.name == self._name:
                self.condition.level = int.from_bytes(status.level, 'little')
                self.condition.message = status.message

    def _on_weights(self, message: Any) -> None:
        self.weights = bytes(message.data)


@contextmanager
def live_robot(seconds: float, ros_args: list[str]) -> Iterator[LiveRobot]:
    """Listen to the robot of the graph as long as this lasts; its last `seconds` [s] are kept."""
    with graph([*(ros_args or ['--ros-args']), '--log-level', 'warn']):
        node = Node(f'leo_watch_{os.getpid()}', start_parameter_services=False)
        robot = LiveRobot(node, MessageBuffer(seconds))
        with closing(robot), served_apart(node, LOOK, lambda: None):
            yield robot
