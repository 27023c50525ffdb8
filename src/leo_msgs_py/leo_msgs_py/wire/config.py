# SPDX-License-Identifier: Apache-2.0
"""Domain and discovery range from ROS's environment variables, as Cyclone DDS takes them."""

import os
from xml.sax.saxutils import quoteattr

from leo_msgs_py.errors import UserError

RANGES = ('LOCALHOST', 'SUBNET', 'OFF', 'SYSTEM_DEFAULT')
_LAST_DOMAIN = 232
_LOOPBACK = '<Interfaces><NetworkInterface address="127.0.0.1"/></Interfaces>'
# Lockstep waits for acknowledgements, which readers send when a heartbeat asks: by default each
# 100 ms (180 ms measured per wait), so 1 ms (2 ms measured).
_HEARTBEAT = '<HeartbeatInterval min="1 ms" minsched="1 ms">1 ms</HeartbeatInterval>'


def domain_id() -> int:
    """ROS_DOMAIN_ID, 0 where unset; UserError where it is no number from 0 to 232."""
    text = os.environ.get('ROS_DOMAIN_ID') or '0'
    if not text.isdecimal() or int(text) > _LAST_DOMAIN:
        raise UserError(f'ROS_DOMAIN_ID={text!r} is not a number from 0 to {_LAST_DOMAIN}')
    return int(text)


def discovery_range() -> str:
    """ROS_AUTOMATIC_DISCOVERY_RANGE, LOCALHOST where unset."""
    text = os.environ.get('ROS_AUTOMATIC_DISCOVERY_RANGE') or 'LOCALHOST'
    if text not in RANGES:
        raise UserError(f'ROS_AUTOMATIC_DISCOVERY_RANGE={text!r} is none of {", ".join(RANGES)}')
    return text


def static_peers() -> list[str]:
    """ROS_STATIC_PEERS, separated by semicolons."""
    return [peer for peer in os.environ.get('ROS_STATIC_PEERS', '').split(';') if peer]


def cyclone_config(reach: str, peers: list[str]) -> str:
    """Cyclone DDS configuration of a discovery range, followed by CYCLONEDDS_URI.

    The same settings as rmw_cyclonedds makes (rmw_node.cpp, check_create_domain): a side with
    multicast and one without never meet. On top of them LOCALHOST without static peers takes the
    loopback interface. Measured against Cyclone DDS 0.10.5 with ROS's settings: on loopback we
    are found whoever starts first, on the default interface only if ROS does.
    """
    users = os.environ.get('CYCLONEDDS_URI', '')
    if reach == 'SYSTEM_DEFAULT':
        return users
    loopback = _LOOPBACK if reach == 'LOCALHOST' and not peers else ''
    silent = '' if reach == 'SUBNET' else _tag('AllowMulticast', 'false')
    general = _tag('General', loopback + silent) if silent else ''
    if reach == 'OFF':
        alone = _tag('Tag', f'ros_discovery_off_{os.getpid()}')
        discovery = _tag('ParticipantIndex', 'none') + alone
    else:
        found = ['localhost', *peers] if reach == 'LOCALHOST' else peers
        discovery = _tag('ParticipantIndex', 'auto') + _tag('MaxAutoParticipantIndex', '32')
        if found:
            discovery += _tag('Peers', ''.join(f'<Peer address={quoteattr(p)}/>' for p in found))
    internal = _tag('Internal', _HEARTBEAT)
    domain = _tag('Domain', general + _tag('Discovery', discovery) + internal)
    return ','.join(part for part in (_tag('CycloneDDS', domain), users) if part)


def describe() -> str:
    """Transport, domain and discovery range in words, for a node's first log line."""
    return f'cyclonedds transport, ROS_DOMAIN_ID {domain_id()}, discovery {discovery_range()}'


def _tag(name: str, content: str) -> str:
    return f'<{name}>{content}</{name}>'
