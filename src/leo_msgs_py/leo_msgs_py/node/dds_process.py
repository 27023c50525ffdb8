# SPDX-License-Identifier: Apache-2.0
"""The process's one DDS context, made with its first node."""

from __future__ import annotations

from leo_msgs_py.node.args import RosArgs
from leo_msgs_py.node.clock import Clock
from leo_msgs_py.node.context import Context
from leo_msgs_py.node.dds_backend import DdsNode
from leo_msgs_py.wire import config

_contexts: list[Context] = []


def create_node(name: str, args: list[str], parsed: RosArgs) -> DdsNode:
    """Create a node, and the participant with the first one."""
    if not _contexts:
        _contexts.append(Context())
    return DdsNode(_contexts[0], name, parsed)


def spin_once(node: DdsNode, timeout_sec: float | None) -> None:
    """Run what is ready on any node of the process."""
    if _contexts:
        _contexts[0].spin_once(timeout_sec)


def ok() -> bool:
    """Whether there is a context that was not told to stop."""
    return bool(_contexts) and _contexts[0].running


def shutdown() -> None:
    """Leave the graph; the next node starts anew."""
    if _contexts:
        _contexts.pop().shutdown()


def wall_clock() -> Clock:
    """A clock that no /clock stops."""
    return Clock()


def describe() -> str:
    """Transport, domain and discovery range in words."""
    return config.describe()
