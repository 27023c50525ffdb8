# SPDX-License-Identifier: Apache-2.0
"""`leo topic`: list, look at and publish topics."""

from __future__ import annotations

import argparse
from typing import Any

from leo_msgs_py.verbs import common
from leo_msgs_py.verbs.topic_streams import echo, hz, pub

_LIST_EXAMPLES = '  leo topic list -t\n  leo topic list --json\n'
_INFO_EXAMPLES = '  leo topic info /joint_states -v\n'
_EXAMPLES = (
    _LIST_EXAMPLES
    + _INFO_EXAMPLES
    + '  leo topic echo /joint_states --once\n  leo topic hz /joint_states\n'
    + '  leo topic pub --once /voltage_controller/commands std_msgs/msg/Float64MultiArray'
    + " '{data: [1.5]}'\n"
)


def main(argv: list[str]) -> int:
    """Run `leo topic list|info|echo|hz|pub`."""
    verbs = {'list': _list, 'info': _info, 'echo': echo, 'hz': hz, 'pub': pub}
    description = 'List, look at and publish topics.'
    return common.dispatch('leo topic', description, verbs, argv, _EXAMPLES)


def _list(argv: list[str]) -> int:
    parser = common.Parser('leo topic list', 'List the topics.', _LIST_EXAMPLES)
    parser.add_argument('-t', '--show-types', action='store_true', help='with their types')
    parser.add_json()
    options = parser.parse_args(argv)
    with common.probe() as node:
        common.settle(node)
        found = node.get_topic_names_and_types()
    lines = [f'{n} [{", ".join(t)}]' if options.show_types else n for n, t in found]
    common.show(options, dict(found), lines)
    return 0


def _info(argv: list[str]) -> int:
    parser = common.Parser('leo topic info', 'Type and endpoints of a topic.', _INFO_EXAMPLES)
    parser.add_argument('topic')
    parser.add_argument('-v', '--verbose', action='store_true', help='each endpoint and its QoS')
    parser.add_json()
    options = parser.parse_args(argv)
    with common.probe() as node:
        common.settle(node)
        topic = common.absolute(options.topic)
        kind = common.one_type(topic, node.get_topic_names_and_types(), 'topic')
        publishers = node.get_publishers_info_by_topic(topic)
        subscriptions = node.get_subscriptions_info_by_topic(topic)
    data = {
        'type': kind,
        'publishers': [_endpoint(info) for info in publishers],
        'subscriptions': [_endpoint(info) for info in subscriptions],
    }
    common.show(options, data, _info_lines(data, options))
    return 0


def _info_lines(data: dict[str, Any], options: argparse.Namespace) -> list[str]:
    lines = [f'Type: {data["type"]}']
    for title, key in (('Publisher', 'publishers'), ('Subscription', 'subscriptions')):
        lines.append(f'{title} count: {len(data[key])}')
        if options.verbose:
            lines += [common.as_yaml([endpoint]).rstrip() for endpoint in data[key]]
    return lines


def _endpoint(info: Any) -> dict[str, Any]:
    return {
        'node': f'{info.node_namespace.rstrip("/")}/{info.node_name}',
        'type': info.topic_type,
        'type_hash': str(info.topic_type_hash),
        'gid': bytes(info.endpoint_gid).hex('.'),
        'qos': _qos(info.qos_profile),
    }


def _qos(profile: Any) -> dict[str, Any]:
    return {'reliability': _words(profile.reliability), 'durability': _words(profile.durability)}


def _words(policy: Any) -> str:
    return str(policy.name).lower().replace('_', ' ')
