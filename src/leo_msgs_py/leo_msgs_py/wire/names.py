# SPDX-License-Identifier: Apache-2.0
"""ROS names and their DDS spelling.

A topic /x is 'rt/x', a service /s is 'rq/sRequest' and 'rr/sReply'; a type 'pkg/msg/Name' is
'pkg::msg::dds_::Name_' (rmw_cyclonedds; measured against a real node).
"""

import re

from leo_msgs_py.errors import UserError

_TOKEN = re.compile(r'[A-Za-z_][A-Za-z0-9_]*')
_TYPE = re.compile(r'(\w+)::(\w+)::dds_::(\w+)_')
_SERVICE = {'rq/': 'Request', 'rr/': 'Reply'}


def expand(name: str, namespace: str, node: str) -> str:
    """Absolute name of a relative, absolute or private ('~/x') one.

    Raises:
        UserError: not a valid ROS name.
    """
    if name == '~' or name.startswith('~/'):
        full = join(join(namespace, node), name[2:])
    else:
        full = name if name.startswith('/') else join(namespace, name)
    if not is_valid(full):
        raise UserError(
            f'{name!r} is not a ROS name: use letters, digits, _ and /, no digit first'
        )
    return full


def join(namespace: str, name: str) -> str:
    """'/ns' and 'name' as '/ns/name'."""
    return f'{namespace.rstrip("/")}/{name}' if name else namespace


def is_valid(full: str) -> bool:
    """Whether an absolute name is made of valid tokens."""
    return full.startswith('/') and all(_TOKEN.fullmatch(token) for token in full[1:].split('/'))


def check_node(namespace: str, name: str) -> None:
    """Raise UserError for a node name or namespace ROS would refuse."""
    if not _TOKEN.fullmatch(name):
        raise UserError(f'node name {name!r} must be letters, digits and _, no digit first')
    if namespace != '/' and not is_valid(namespace):
        raise UserError(f'namespace {namespace!r} must be like /a/b')


def topic_to_dds(name: str) -> str:
    """'/x' as 'rt/x'."""
    return f'rt{name}'


def topic_from_dds(dds: str) -> str | None:
    """'rt/x' as '/x', None for what is no ROS topic."""
    return dds[2:] if dds.startswith('rt/') else None


def request_topic(service: str) -> str:
    """DDS topic of a service's requests."""
    return f'rq{service}Request'


def reply_topic(service: str) -> str:
    """DDS topic of a service's replies."""
    return f'rr{service}Reply'


def service_from_dds(dds: str) -> str | None:
    """'rq/sRequest' or 'rr/sReply' as '/s', None for anything else."""
    suffix = _SERVICE.get(dds[:3])
    if suffix is None or not dds.endswith(suffix):
        return None
    return dds[2 : -len(suffix)]


def type_to_dds(name: str) -> str:
    """'pkg/msg/Name' as 'pkg::msg::dds_::Name_'."""
    package, kind, leaf = name.split('/')
    return f'{package}::{kind}::dds_::{leaf}_'


def type_from_dds(dds: str) -> str | None:
    """'pkg::msg::dds_::Name_' as 'pkg/msg/Name', None for what is no ROS type."""
    found = _TYPE.fullmatch(dds)
    return '/'.join(found.groups()) if found else None


def service_type_from_dds(dds: str) -> str | None:
    """Service type of one of its halves: 'pkg::srv::dds_::Name_Request_' as 'pkg/srv/Name'."""
    half = type_from_dds(dds)
    return re.sub(r'_(Request|Response)$', '', half) if half else None
