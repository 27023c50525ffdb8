# SPDX-License-Identifier: Apache-2.0
"""What a bag should say about its robot, asked from the robot node's parameters."""

from __future__ import annotations

from typing import Any

from leo_msgs_py.errors import UserError
from leo_msgs_py.messages import load

FACTS = ('robot', 'start', 'noise', 'seed', 'state_rate', 'realtime_factor')
"""Parameters of the robot node that belong into a bag; hidden effects are no parameter of it."""

PATIENCE = 4
"""Polls without an answer after which a request is given up."""


class RobotFacts:
    """Asks the node `robot` beside ours, now and again, without ever waiting.

    Args:
        node: of the node layer.
        robot: the model to name where nobody answers (hardware on plain ROS topics).
    """

    def __init__(self, node: Any, robot: str = '') -> None:
        self._service = load('rcl_interfaces/srv/GetParameters')
        self._client = node.create_client(self._service, 'robot/get_parameters')
        self._future: Any = None
        self._unanswered = 0
        self._known = {'robot': robot} if robot else {}

    def poll(self) -> dict[str, str]:
        """Return what is known by now and ask again; the answer counts at the next call."""
        if self._future is not None and self._future.done():
            self._known.update(facts_of(self._future.result().values))
            self._future = None
        self._forget_unanswered()
        if self._future is None and self._client.service_is_ready():
            self._future = self._client.call_async(self._service.Request(names=list(FACTS)))
        return dict(self._known)

    def _forget_unanswered(self) -> None:
        """Give up a request that a killed robot took with it."""
        self._unanswered = self._unanswered + 1 if self._future is not None else 0
        if self._unanswered > PATIENCE:
            self._client.remove_pending_request(self._future)
            self._future = None


def facts_of(values: Any) -> dict[str, str]:
    """What the values (rcl_interfaces/ParameterValue) of `FACTS` say, and whether it is held."""
    found = {name: _text(value) for name, value in zip(FACTS, values, strict=False)}
    known = {name: text for name, text in found.items() if text}
    return known | held_in(known)


def _text(value: Any) -> str:
    """Return a rcl_interfaces/ParameterValue as text, '' for one that is not set."""
    fields = {
        1: 'bool_value', 2: 'integer_value', 3: 'double_value', 4: 'string_value',
        8: 'double_array_value',
    }
    if value.type not in fields:
        return ''
    content = getattr(value, fields[value.type])
    return str([float(x) for x in content]) if value.type == 8 else str(content)


def held_in(facts: dict[str, str]) -> dict[str, str]:
    """Return whether the base is fixed in the start pose, nothing for a robot not known here."""
    from leo_sim.robot import load_robot

    try:
        robot = load_robot(facts.get('robot', ''))
    except UserError:
        return {}
    pose = robot.start_poses.get(facts.get('start', 'nominal'))
    return {} if pose is None else {'held': str(bool(pose.held)).lower()}
