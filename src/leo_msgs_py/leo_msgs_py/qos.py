# SPDX-License-Identifier: Apache-2.0
"""Quality of service under rclpy's names: rclpy's own classes where it imports."""

from __future__ import annotations

from dataclasses import dataclass
from enum import Enum
from typing import TYPE_CHECKING

from leo_msgs_py.messages import HAVE_ROS

if HAVE_ROS and not TYPE_CHECKING:
    from rclpy.qos import DurabilityPolicy, HistoryPolicy, QoSProfile, ReliabilityPolicy
else:

    class HistoryPolicy(Enum):
        """How many samples are kept."""

        KEEP_LAST = 1
        KEEP_ALL = 2

    class ReliabilityPolicy(Enum):
        """Whether lost samples are sent again."""

        RELIABLE = 1
        BEST_EFFORT = 2

    class DurabilityPolicy(Enum):
        """Whether late joiners get what was sent before."""

        TRANSIENT_LOCAL = 1
        VOLATILE = 2

    @dataclass(frozen=True)
    class QoSProfile:
        """Quality of service of a topic; the defaults are ROS's own."""

        depth: int = 10
        reliability: ReliabilityPolicy = ReliabilityPolicy.RELIABLE
        durability: DurabilityPolicy = DurabilityPolicy.VOLATILE
        history: HistoryPolicy = HistoryPolicy.KEEP_LAST


def reliable(depth: int = 10) -> QoSProfile:
    """Reliable, volatile, keep the last `depth`."""
    return QoSProfile(depth=depth)


def best_effort(depth: int = 1) -> QoSProfile:
    """Best effort, volatile, keep the last `depth`."""
    return QoSProfile(depth=depth, reliability=ReliabilityPolicy.BEST_EFFORT)


def latched(depth: int = 1) -> QoSProfile:
    """Reliable and transient local: late joiners get the last `depth`."""
    return QoSProfile(depth=depth, durability=DurabilityPolicy.TRANSIENT_LOCAL)


__all__ = [
    'DurabilityPolicy',
    'HistoryPolicy',
    'QoSProfile',
    'ReliabilityPolicy',
    'best_effort',
    'latched',
    'reliable',
]
