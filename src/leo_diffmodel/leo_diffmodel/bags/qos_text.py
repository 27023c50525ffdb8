# SPDX-License-Identifier: Apache-2.0
"""Quality of service as rosbag2 keeps it: a YAML list in each channel's metadata."""

from __future__ import annotations

from typing import Any

import yaml

from leo_msgs_py.qos import (
    DurabilityPolicy,
    HistoryPolicy,
    QoSProfile,
    ReliabilityPolicy,
)

_INFINITE = {'sec': 9223372036, 'nsec': 854775807}


def to_yaml(qos: QoSProfile) -> str:
    """Return the `offered_qos_profiles` text of one publisher, as rosbag2 version 9 writes it."""
    profile = {
        'history': _name(qos.history),
        'depth': qos.depth,
        'reliability': _name(qos.reliability),
        'durability': _name(qos.durability),
        'deadline': dict(_INFINITE),
        'lifespan': dict(_INFINITE),
        'liveliness': 'automatic',
        'liveliness_lease_duration': dict(_INFINITE),
        'avoid_ros_namespace_conventions': False,
    }
    return yaml.safe_dump([profile], sort_keys=False)


def from_yaml(text: str) -> QoSProfile:
    """Return the first profile of an `offered_qos_profiles` text, ROS's default for none.

    Names (version 9) and numbers (before) are understood; what is unknown gets the default.
    """
    profiles = yaml.safe_load(text) if text.strip() else None
    if not profiles:
        return QoSProfile(depth=10)
    profile: dict[str, Any] = profiles[0]
    return QoSProfile(
        depth=max(int(profile.get('depth', 10)), 1),
        history=_member(HistoryPolicy, profile.get('history'), HistoryPolicy.KEEP_LAST),
        reliability=_member(
            ReliabilityPolicy, profile.get('reliability'), ReliabilityPolicy.RELIABLE
        ),
        durability=_member(
            DurabilityPolicy, profile.get('durability'), DurabilityPolicy.VOLATILE
        ),
    )


def profiles(text: str) -> list[dict[str, Any]]:
    """Return an `offered_qos_profiles` text as the list that metadata.yaml holds."""
    return yaml.safe_load(text) or [] if text.strip() else []


def _name(policy: Any) -> str:
    return str(policy.name).lower()


def _member(policies: Any, value: str | int | None, default: Any) -> Any:
    """Return the policy of a name ('reliable') or of rmw's number (1)."""
    for policy in policies:
        if value in (policy.value, _name(policy)):
            return policy
    return default
