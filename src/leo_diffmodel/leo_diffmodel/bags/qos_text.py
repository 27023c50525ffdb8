# SPDX-License-Identifier: Apache-2.0
"""Quality of service as rosbag2 keeps it: a YAML list in each channel's metadata."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import yaml

_INFINITE = {'sec': 9223372036, 'nsec': 854775807}
_NUMBERS = {
    'history': {1: 'keep_last', 2: 'keep_all'},
    'reliability': {1: 'reliable', 2: 'best_effort'},
    'durability': {1: 'transient_local', 2: 'volatile'},
}
"""Policies by rmw's number, as bags before version 9 have them."""


@dataclass(frozen=True)
class Qos:
    """Quality of service of a topic, policies by their names; the defaults are ROS's own."""

    history: str = 'keep_last'
    depth: int = 10
    reliability: str = 'reliable'
    durability: str = 'volatile'


def to_yaml(qos: Any) -> str:
    """Return the `offered_qos_profiles` text of one publisher, as rosbag2 version 9 writes it.

    Args:
        qos: a `Qos`, or rclpy's QoSProfile.
    """
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


def from_yaml(text: str) -> Qos:
    """Return the first profile of an `offered_qos_profiles` text, ROS's default for none.

    Names (version 9) and numbers (before) are understood; what is unknown gets the default.
    """
    found = profiles(text)
    if not found:
        return Qos()
    policies = {policy: _policy(policy, found[0].get(policy)) for policy in _NUMBERS}
    return Qos(depth=max(int(found[0].get('depth', 10)), 1), **policies)


def profiles(text: str) -> list[dict[str, Any]]:
    """Return an `offered_qos_profiles` text as the list that metadata.yaml holds."""
    return yaml.safe_load(text) or [] if text.strip() else []


def _name(policy: Any) -> str:
    return str(getattr(policy, 'name', policy)).lower()


def _policy(policy: str, value: str | int | None) -> str:
    """Return a policy's name from its name ('reliable') or from rmw's number (1)."""
    names = _NUMBERS[policy]
    name = names.get(value) if isinstance(value, int) else value
    return str(name if name in names.values() else getattr(Qos, policy))
