# SPDX-License-Identifier: Apache-2.0
"""`leo topic`: list, look at and publish topics."""

import argparse
from itertools import pairwise
import json
from statistics import fmean, pstdev
import sys
import time
from typing import Any

from leo_msgs_py.errors import UserError
from leo_msgs_py.interfaces import fill, load, to_plain
from leo_msgs_py.verbs import common

_EXAMPLES = {
    'list': '  leo topic list -t\n  leo topic list --json\n',
    'info': '  leo topic info /joint_states -v\n',
    'echo': '  leo topic echo /joint_states\n  leo topic echo /robot/episode --once\n'
    '  leo topic echo /joint_states --json | head -5\n',
    'hz': '  leo topic hz /joint_states\n  leo topic hz /joint_states --once\n',
}
_PUB_EXAMPLES = (
    '  leo topic pub -r 20 /voltage_controller/commands std_msgs/msg/Float64MultiArray'
    " '{data: [1.5]}'\n"
    "  leo topic pub --once /chatter std_msgs/msg/String '{data: hello}'\n"
)
_DEPTH = 100
_MATCH_S = 3.0
_LINGER_S = 0.3


def main(argv: list[str]) -> int:
    verbs = {'list': _list, 'info': _info, 'echo': _echo, 'hz': _hz, 'pub': _pub}
    description = 'List, look at and publish topics.'
    examples = ''.join(_EXAMPLES.values()) + _PUB_EXAMPLES
    return common.dispatch('leo topic', description, verbs, argv, examples)


def _list(argv: list[str]) -> int:
    def found(node: Any) -> common.Pairs:
        return list(node.get_topic_names_and_types())

    return common.list_typed(argv, 'topic', _EXAMPLES['list'], found, 'List the topics.')


def _info(argv: list[str]) -> int:
    parser = common.Parser('leo topic info', 'Type and endpoints of a topic.', _EXAMPLES['info'])
    parser.add_argument('topic')
    parser.flag('-v --verbose', 'each endpoint and its QoS')
    options = parser.parse_args(argv)
    with common.probe() as node:
        topic = common.absolute(options.topic)
        data = {
            'type': common.one_type(topic, node.get_topic_names_and_types(), 'topic'),
            'publishers': [*map(_endpoint, node.get_publishers_info_by_topic(topic))],
            'subscriptions': [*map(_endpoint, node.get_subscriptions_info_by_topic(topic))],
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
    qos = info.qos_profile
    policies = {'reliability': qos.reliability, 'durability': qos.durability}
    return {
        'node': f'{info.node_namespace.rstrip("/")}/{info.node_name}',
        'type': info.topic_type,
        'type_hash': str(info.topic_type_hash),
        'gid': bytes(info.endpoint_gid).hex('.'),
        'qos': {name: p.name.lower().replace('_', ' ') for name, p in policies.items()},
    }


def _echo(argv: list[str]) -> int:
    options = _stream_options('leo topic echo', 'Print the messages of a topic.', 'message', argv)
    from leo_msgs_py.node import running, spin_once

    received: list[Any] = []
    with common.probe() as node:
        _subscribe(node, options, received.append, raw=False)
        while running() and not (options.once and received):
            received.clear()
            spin_once()
            # Not in the callback: rclpy logs what that raises, a closed pipe too.
            for message in received[:1] if options.once else received:
                data = to_plain(message)
                text = json.dumps(data) if options.json else f'{common.as_yaml(data)}---'
                print(text, flush=True)
    return 0


def _hz(argv: list[str]) -> int:
    options = _stream_options('leo topic hz', 'Print the rate of a topic.', 'line', argv)
    from leo_msgs_py.node import running, spin_until

    stamps: list[float] = []
    with common.probe() as node:
        _subscribe(node, options, lambda data: stamps.append(time.monotonic()), raw=True)
        while running():
            stamps.clear()
            spin_until(lambda: False, 1.0)
            if len(stamps) > 1:
                _print_rate([b - a for a, b in pairwise(stamps)], options.json)
            elif running():
                print('no new messages', file=sys.stderr, flush=True)
            if options.once and len(stamps) > 1:
                break
    return 0


def _stream_options(verb: str, about: str, what: str, argv: list[str]) -> argparse.Namespace:
    parser = common.Parser(verb, about, _EXAMPLES[verb.split()[-1]])
    parser.add_argument('topic')
    parser.add('type', 'type, where nobody publishes yet', nargs='?')
    parser.flag('--once', f'stop after the first {what}')
    return parser.parse_args(argv)


def _pub(argv: list[str]) -> int:
    parser = common.Parser('leo topic pub', 'Publish messages.', _PUB_EXAMPLES, json=False)
    parser.add_argument('topic')
    parser.add('type', 'for example std_msgs/msg/String')
    parser.add('values', 'fields as YAML', nargs='?', default='')
    group = parser.add_mutually_exclusive_group()
    group.add_argument('-r', '--rate', type=float, default=1.0, help='messages per second')
    group.add_argument('-1', '--once', action='store_true', help='wait for a reader, send one')
    options = parser.parse_args(argv)
    if options.rate <= 0:
        raise UserError(f'--rate {options.rate} must be above 0')
    message = fill(load(options.type)(), common.from_yaml(options.values))
    from rclpy.qos import DurabilityPolicy, QoSProfile

    # As `ros2 topic pub`, so that readers of either durability match.
    qos = QoSProfile(depth=1 if options.once else 10, durability=DurabilityPolicy.TRANSIENT_LOCAL)
    with common.probe(settled=False) as node:
        publisher = node.create_publisher(type(message), common.absolute(options.topic), qos)
        return _send(publisher, message, options)


def _send(publisher: Any, message: Any, options: argparse.Namespace) -> int:
    from leo_msgs_py.node import running, spin_until

    matched = spin_until(lambda: publisher.get_subscription_count() > 0, _MATCH_S)
    if not matched:
        print(f'nobody subscribes to {options.topic} {common.where()}', file=sys.stderr)
    count = 0
    due = time.monotonic()
    while running():
        count += 1
        print(f'publishing #{count}: {message}', flush=True)
        publisher.publish(message)
        if options.once:
            spin_until(lambda: False, _LINGER_S)
            return 0 if matched else 1
        due += 1 / options.rate
        spin_until(lambda: False, max(0.0, due - time.monotonic()))
    return 0


def _subscribe(node: Any, options: argparse.Namespace, receive: Any, raw: bool) -> None:
    topic = common.absolute(options.topic)
    kind = options.type or common.one_type(topic, node.get_topic_names_and_types(), 'topic')
    node.create_subscription(load(kind), topic, receive, _matching(node, topic), raw=raw)


def _matching(node: Any, topic: str) -> Any:
    from rclpy.qos import DurabilityPolicy, QoSProfile, ReliabilityPolicy

    offered = [info.qos_profile for info in node.get_publishers_info_by_topic(topic)]
    reliable = all(p.reliability == ReliabilityPolicy.RELIABLE for p in offered)
    latched = {p.durability for p in offered} == {DurabilityPolicy.TRANSIENT_LOCAL}
    return QoSProfile(
        depth=_DEPTH,
        reliability=ReliabilityPolicy.RELIABLE if reliable else ReliabilityPolicy.BEST_EFFORT,
        durability=DurabilityPolicy.TRANSIENT_LOCAL if latched else DurabilityPolicy.VOLATILE,
    )


def _print_rate(gaps: list[float], as_json: bool) -> None:
    figures = {
        'rate': 1 / fmean(gaps),
        'min': min(gaps),
        'max': max(gaps),
        'std_dev': pstdev(gaps),
        'window': len(gaps) + 1,
    }
    if as_json:
        text = json.dumps({name: float(value) for name, value in figures.items()})
    else:
        text = (
            'average rate: {rate:.3f} Hz\n\tmin: {min:.4f} s max: {max:.4f} s '
            'std dev: {std_dev:.5f} s window: {window}'
        ).format(**figures)
    print(text, flush=True)
