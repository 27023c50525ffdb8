# SPDX-License-Identifier: Apache-2.0
"""What a bag should say about its robot, asked from the robot node's parameters."""

from collections.abc import Iterable
from typing import Any

from rcl_interfaces.msg import ParameterValue
from rcl_interfaces.srv import GetParameters
from rclpy.node import Node
from rclpy.parameter import parameter_value_to_python

from leo_msgs_py.errors import UserError

FACTS = ('robot', 'start', 'noise', 'seed', 'realtime_factor')
"""Parameters of the robot node that belong into a bag; hidden effects are no parameter of it."""

PATIENCE = 4  # polls without an answer after which a request is given up


class RobotFacts:
    """Asks the node `robot` now and again, without ever waiting.

    `robot` is the model to name where nobody answers (hardware on plain ROS topics).
    """

    def __init__(self, node: Node, robot: str = '') -> None:
        self._client = node.create_client(GetParameters, 'robot/get_parameters')
        self._names: tuple[str, ...] = FACTS
        self._future: Any = None
        self._unanswered = 0
        self._known = {'robot': robot} if robot else {}

    def poll(self) -> dict[str, str]:
        if self._future is not None and self._future.done():
            values = self._future.result().values
            if not values:  # rclpy answers nothing where it lacks one
                self._names = FACTS[:1]
            self._known.update(facts_of(values))
            self._future = None
        self._unanswered = self._unanswered + 1 if self._future is not None else 0
        if self._unanswered > PATIENCE:  # a killed robot took the request with it
            self._client.remove_pending_request(self._future)
            self._future = None
        if self._future is None and self._client.service_is_ready():
            self._future = self._client.call_async(GetParameters.Request(names=list(self._names)))
        return dict(self._known)


def facts_of(values: Iterable[ParameterValue]) -> dict[str, str]:
    found = {name: _text(value) for name, value in zip(FACTS, values, strict=False)}
    known = {name: text for name, text in found.items() if text}
    return known | held_in(known)


def _text(message: ParameterValue) -> str:
    value = parameter_value_to_python(message)
    if value is None:
        return ''
    return str(value if isinstance(value, (bool, int, float, str)) else list(value))


def held_in(facts: dict[str, str]) -> dict[str, str]:
    """Return whether the base is fixed in the start pose, nothing for a robot not known here."""
    from leo_sim.description.robot import load_robot

    try:
        robot = load_robot(facts.get('robot', ''))
    except UserError:
        return {}
    pose = robot.start_poses.get(facts.get('start', 'nominal'))
    return {} if pose is None else {'held': str(bool(pose.held)).lower()}
