# SPDX-License-Identifier: Apache-2.0
"""ROS quality of service and user data as Cyclone QoS, mapped as rmw_cyclonedds does."""

from typing import Any

from cyclonedds.core import Policy, Qos
from cyclonedds.util import duration

from leo_msgs_py.qos import DurabilityPolicy, HistoryPolicy, QoSProfile, ReliabilityPolicy
from leo_msgs_py.wire.hashes import type_hash

_UNLIMITED = -1
_FOREVER = duration(infinite=True)


def endpoint_qos(
    profile: QoSProfile, type_name: str, identity: str = '', lifespan_ns: int | None = None
) -> Qos:
    """Cyclone QoS of a ROS writer or reader.

    Args:
        profile: the ROS profile.
        type_name: message or service half whose hash goes into USER_DATA.
        identity: 'clientid=...;' or 'serviceid=...;' in front of the hash.
        lifespan_ns: how long a writer's samples live [ns], None for ever.
    """
    history = _history(profile)
    policies = [
        history,
        _reliability(profile),
        Policy.DataRepresentation(use_cdrv0_representation=True),
        Policy.WriterDataLifecycle(autodispose=False),
        Policy.Userdata(f'{identity}typehash={type_hash(type_name)};'.encode()),
    ]
    if profile.durability == DurabilityPolicy.TRANSIENT_LOCAL:
        unlimited = (_UNLIMITED, _UNLIMITED, _UNLIMITED)
        policies += [
            Policy.Durability.TransientLocal,
            Policy.DurabilityService(0, history, *unlimited),
        ]
    if lifespan_ns is not None:
        policies.append(Policy.Lifespan(lifespan_ns))
    return Qos(*policies)


def as_profile(qos: Qos) -> QoSProfile:
    """ROS profile of a discovered endpoint (depth 0 where its history is not announced)."""
    history = qos[Policy.History]
    keep_all = history is Policy.History.KeepAll
    reliable = isinstance(qos[Policy.Reliability], Policy.Reliability.Reliable)
    latched = qos[Policy.Durability] == Policy.Durability.TransientLocal
    return QoSProfile(
        depth=getattr(history, 'depth', 0),
        history=HistoryPolicy.KEEP_ALL if keep_all else HistoryPolicy.KEEP_LAST,
        reliability=ReliabilityPolicy.RELIABLE if reliable else ReliabilityPolicy.BEST_EFFORT,
        durability=(DurabilityPolicy.TRANSIENT_LOCAL if latched else DurabilityPolicy.VOLATILE),
    )


def user_data(qos: Qos) -> dict[str, str]:
    """USER_DATA 'a=b;c=d;' of a discovered participant or endpoint as a dictionary."""
    policy = qos[Policy.Userdata]
    text = policy.data.decode(errors='replace') if policy else ''
    return dict(part.split('=', 1) for part in text.split(';') if '=' in part)


def participant_qos(enclave: str = '/') -> Qos:
    """Cyclone QoS of a ROS participant."""
    return Qos(Policy.Userdata(f'enclave={enclave};'.encode()))


def _history(profile: QoSProfile) -> Any:
    if profile.history == HistoryPolicy.KEEP_ALL:
        return Policy.History.KeepAll
    return Policy.History.KeepLast(profile.depth)


def _reliability(profile: QoSProfile) -> Any:
    if profile.reliability == ReliabilityPolicy.BEST_EFFORT:
        return Policy.Reliability.BestEffort
    return Policy.Reliability.Reliable(_FOREVER)
