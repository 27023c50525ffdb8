# SPDX-License-Identifier: Apache-2.0
"""`leo topic`: list, look at and publish topics."""

from __future__ import annotations

import argparse
import json
import sys
import time
from typing import Any

import numpy as np

from leo_msgs_py.errors import UserError
from leo_msgs_py.interfaces import fill, load, to_plain
from leo_msgs_py.verbs import common

_LIST_EXAMPLES = '  leo topic list -t\n  leo topic list --json\n'
_INFO_EXAMPLES = '  leo topic info /joint_states -v\n'
_EXAMPLES = (
    _LIST_EXAMPLES
    + _INFO_EXAMPLES
    + '  leo topic echo /joint_states --once\n  leo topic hz /joint_states\n'
    + '  leo topic pub --once /voltage_controller/commands std_msgs/msg/Float64MultiArray'
    + " '{data: [1.5]}'\n"
)
_ECHO_EXAMPLES = (
    '  leo topic echo /joint_states\n  leo topic echo /robot/episode --once\n'
    '  leo topic echo /joint_states --json | head -5\n'
)
_HZ_EXAMPLES = '  leo topic hz /joint_states\n  leo topic hz /joint_states --once\n'
_PUB_EXAMPLES = (
    '  leo topic pub -r 20 /voltage_controller/commands std_msgs/msg/Float64MultiArray'
    " '{data: [1.5]}'\n"
    "  leo topic pub --once /chatter std_msgs/msg/String '{data: hello}'\n"
)
_DEPTH = 100
_MATCH_S = 3.0
_LINGER_S = 0.3


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


def echo(argv: list[str]) -> int:
    """Print the messages of a topic."""
    parser = common.Parser('leo topic echo', 'Print the messages of a topic.', _ECHO_EXAMPLES)
    parser.add_argument('topic')
    parser.add_argument('type', nargs='?', help='type, where nobody publishes yet')
    parser.add_argument('--once', action='store_true', help='stop after the first message')
    parser.add_json()
    options = parser.parse_args(argv)

    def write(message: Any) -> None:
        data = to_plain(message)
        text = json.dumps(data) if options.json else f'{common.as_yaml(data)}---'
        print(text, flush=True)

    with common.probe() as node:
        _stream(node, options, write, raw=False)
    return 0


def hz(argv: list[str]) -> int:
    """Print the rate of a topic."""
    parser = common.Parser('leo topic hz', 'Print the rate of a topic.', _HZ_EXAMPLES)
    parser.add_argument('topic')
    parser.add_argument('type', nargs='?', help='type, where nobody publishes yet')
    parser.add_argument('--once', action='store_true', help='stop after the first line')
    parser.add_json()
    options = parser.parse_args(argv)
    from leo_msgs_py.node import running, spin_until

    stamps: list[float] = []
    with common.probe() as node:
        _subscribe(node, options, lambda data: stamps.append(time.monotonic()), raw=True)
        while running():
            stamps.clear()
            spin_until(lambda: False, 1.0)
            if len(stamps) > 1:
                _print_rate(np.diff(stamps), options.json)
            elif running():
                print('no new messages', file=sys.stderr, flush=True)
            if options.once and len(stamps) > 1:
                break
    return 0


def pub(argv: list[str]) -> int:
    """Publish messages typed on the command line."""
    parser = common.Parser('leo topic pub', 'Publish messages.', _PUB_EXAMPLES)
    parser.add_argument('topic')
    parser.add_argument('type', help='for example std_msgs/msg/String')
    parser.add_argument('values', nargs='?', default='', help='fields as YAML')
    group = parser.add_mutually_exclusive_group()
    group.add_argument('-r', '--rate', type=float, default=1.0, help='messages per second')
    group.add_argument('-1', '--once', action='store_true', help='wait for a reader, send one')
    options = parser.parse_args(argv)
    if options.rate <= 0:
        raise UserError(f'--rate {options.rate} must be above 0')
    message = fill(load(options.type)(), common.from_yaml(options.values))
    with common.probe() as node:
        publisher = node.create_publisher(
            type(message), common.absolute(options.topic), _latched(options.once)
        )
        return _send(node, publisher, message, options)


def _send(node: Any, publisher: Any, message: Any, options: argparse.Namespace) -> int:
    from leo_msgs_py.node import running, spin_until

    heard = spin_until(lambda: publisher.get_subscription_count() > 0, _MATCH_S)
    if not heard:
        print(f'nobody subscribes to {options.topic} {common.where()}', file=sys.stderr)
    count = 0
    due = time.monotonic()
    while running():
        count += 1
        print(f'publishing #{count}: {message}', flush=True)
        publisher.publish(message)
        if options.once:
            spin_until(lambda: False, _LINGER_S)
            return 0 if heard else 1
        due += 1 / options.rate
        spin_until(lambda: False, max(0.0, due - time.monotonic()))
    return 0


def _latched(once: bool) -> Any:
    """Transient local as `ros2 topic pub`, so that readers of either durability match."""
    from rclpy.qos import DurabilityPolicy, QoSProfile

    return QoSProfile(depth=1 if once else 10, durability=DurabilityPolicy.TRANSIENT_LOCAL)


def _stream(node: Any, options: argparse.Namespace, write: Any, raw: bool) -> None:
    """Call back with each message until interrupted, or with the first one only."""
    from leo_msgs_py.node import running, spin_once

    heard: list[Any] = []
    _subscribe(node, options, heard.append, raw)
    while running() and not (options.once and heard):
        heard.clear()
        spin_once()
        # Not in the callback: rclpy logs what that raises, a closed pipe too.
        for message in heard[:1] if options.once else heard:
            write(message)


def _subscribe(node: Any, options: argparse.Namespace, receive: Any, raw: bool) -> None:
    common.settle(node)
    topic = common.absolute(options.topic)
    kind = options.type or common.one_type(topic, node.get_topic_names_and_types(), 'topic')
    node.create_subscription(load(kind), topic, receive, _matching(node, topic), raw=raw)


def _matching(node: Any, topic: str) -> Any:
    """The strongest QoS every publisher of the topic offers."""
    from rclpy.qos import DurabilityPolicy, QoSProfile, ReliabilityPolicy

    offered = [info.qos_profile for info in node.get_publishers_info_by_topic(topic)]
    reliable = all(p.reliability == ReliabilityPolicy.RELIABLE for p in offered)
    latched = bool(offered) and all(
        p.durability == DurabilityPolicy.TRANSIENT_LOCAL for p in offered
    )
    return QoSProfile(
        depth=_DEPTH,
        reliability=ReliabilityPolicy.RELIABLE if reliable else ReliabilityPolicy.BEST_EFFORT,
        durability=DurabilityPolicy.TRANSIENT_LOCAL if latched else DurabilityPolicy.VOLATILE,
    )


def _print_rate(gaps: np.ndarray, as_json: bool) -> None:
    if as_json:
        figures = {
            'rate': 1 / gaps.mean(),
            'min': gaps.min(),
            'max': gaps.max(),
            'std_dev': gaps.std(),
            'window': gaps.size + 1,
        }
        print(json.dumps({name: float(value) for name, value in figures.items()}), flush=True)
        return
    print(
        f'average rate: {1 / gaps.mean():.3f} Hz\n'
        f'\tmin: {gaps.min():.4f} s max: {gaps.max():.4f} s '
        f'std dev: {gaps.std():.5f} s window: {gaps.size + 1}',
        flush=True,
    )
