# SPDX-License-Identifier: Apache-2.0
"""What the verbs share: command lines, a node to look around with, YAML, printing."""

import argparse
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager
import json
import math
import os
import re
import time
from typing import Any, NoReturn

import yaml

from leo_msgs_py.errors import UserError

_AT_LEAST_S = 0.5
_QUIET_S = 0.3
_AT_MOST_S = 3.0
_YAML_FLOAT = re.compile(
    r'[-+]?(?:[0-9]+\.[0-9]*|\.[0-9]+|[0-9]+(?=[eE]))(?:[eE][-+]?[0-9]+)?$'
    r'|[-+]?\.(?:inf|Inf|INF)$|\.(?:nan|NaN|NAN)$'
)
_YAML_INT = re.compile(r'[-+]?(?:0[xX][0-9a-fA-F]+|0[0-7]*|[1-9][0-9]*)$')
_OURS = ('float', 'int', 'timestamp')

Pairs = list[tuple[str, list[str]]]  # names of topics or services with their types


class Parser(argparse.ArgumentParser):
    """A command line whose mistakes are UserErrors and whose help shows examples."""

    def __init__(self, prog: str, description: str, examples: str, json: bool = True) -> None:
        super().__init__(
            prog=prog,
            description=description,
            epilog=f'examples:\n{examples}',
            formatter_class=argparse.RawDescriptionHelpFormatter,
        )
        self.register('type', float, _number)
        if json:
            self.flag('--json', 'print the result as JSON')

    def error(self, message: str) -> NoReturn:
        raise UserError(f"{self.prog}: {message}; see '{self.prog} --help'")

    def add(self, names: str, about: str, **options: Any) -> None:
        """Accept an argument by its names, and in capitals what it takes: '-o --output DIR'.

        It is of the type of a default; other `options` are those of `add_argument`.
        """
        first, *more = names.split()
        if more and more[-1][0].isupper():
            options['metavar'] = more.pop()
        if isinstance(options.get('default'), int | float):
            options.setdefault('type', type(options['default']))
        self.add_argument(first, *more, help=about, **options)

    def flag(self, names: str, about: str) -> None:
        self.add(names, about, action='store_true')


def _number(text: str) -> float:
    """A float as typed; NaN is none."""
    value = float(text)
    if math.isnan(value):
        raise ValueError(text)
    return value


def ros_args_apart(argv: list[str]) -> tuple[list[str], list[str]]:
    """Words of the command, then everything from --ros-args on."""
    at = argv.index('--ros-args') if '--ros-args' in argv else len(argv)
    return argv[:at], argv[at:]


def dispatch(
    prog: str,
    description: str,
    verbs: Mapping[str, Callable[[list[str]], int]],
    argv: list[str],
    examples: str,
) -> int:
    parser = Parser(prog, description, examples, json=False)
    parser.add_argument('verb', choices=list(verbs), metavar='|'.join(verbs))
    rest = parser.add_argument('args', nargs=argparse.REMAINDER, help=argparse.SUPPRESS)
    rest.required = False
    options = parser.parse_args(argv)
    return verbs[options.verb](options.args)


@contextmanager
def probe(settled: bool = True) -> Iterator[Any]:
    """A hidden node to look at the graph with, `settled` before; left again at the end."""
    from rclpy.node import Node

    from leo_msgs_py.node import graph, join

    with graph(['--ros-args', '--log-level', 'error']):
        node = join(Node(f'_leo_{os.getpid()}', start_parameter_services=False))
        if settled:
            settle(node)
        yield node


def settle(node: Any) -> None:
    """Spin until somebody is seen and discovery is quiet for a moment, a few seconds at most."""
    from leo_msgs_py.node import running, spin_once

    start = changed = time.monotonic()
    seen: Any = None
    while running():
        now = time.monotonic()
        state = (
            sorted(node.get_node_names_and_namespaces()),
            node.get_topic_names_and_types(),
            node.get_service_names_and_types(),
        )
        if state != seen:
            seen, changed = state, now
        somebody = any(name != node.get_name() for name, _ in state[0])
        quiet = somebody and now - start >= _AT_LEAST_S and now - changed >= _QUIET_S
        if quiet or now - start >= _AT_MOST_S:
            return
        spin_once(0.05)


def absolute(name: str) -> str:
    """Topic, service or node name as typed, made absolute; UserError where it is none."""
    from rclpy.exceptions import InvalidTopicNameException
    from rclpy.validate_full_topic_name import validate_full_topic_name

    full = name if name.startswith('/') else f'/{name}'
    try:
        validate_full_topic_name(full)
    except InvalidTopicNameException as error:
        raise UserError(
            f'{name!r} is no name of the graph; write letters, digits and _ between single /'
        ) from error
    return full


def where() -> str:
    """Which domain and discovery range was looked in, and what else to try."""
    from leo_msgs_py.node import describe

    return (
        f'on {describe()}; both sides need the same ROS_DOMAIN_ID, and a reach '
        '(ROS_AUTOMATIC_DISCOVERY_RANGE) that includes the other'
    )


def list_typed(
    argv: list[str], what: str, examples: str, found: Callable[[Any], Pairs], about: str
) -> int:
    """Run `leo topic list` or `leo service list`, of what `found` gives for a node."""
    parser = Parser(f'leo {what} list', about, examples)
    parser.flag('-t --show-types', 'with their types')
    options = parser.parse_args(argv)
    with probe() as node:
        pairs = found(node)
    lines = [f'{n} [{", ".join(t)}]' if options.show_types else n for n, t in pairs]
    show(options, dict(pairs), lines)
    return 0


def one_type(name: str, found: Pairs, what: str) -> str:
    """Type of a topic or service; UserError where it is not there, or has several."""
    kinds = dict(found).get(name)
    if kinds is None:
        ours = re.compile(r'.*/_|/(rosout|parameter_events)$')
        there = ', '.join(known for known, _ in found if not ours.match(known))
        raise UserError(f'no {what} {name}; there are: {there or "none, " + where()}')
    if len(kinds) > 1:
        raise UserError(f'{what} {name} has several types, name one: {", ".join(kinds)}')
    return kinds[0]


def show(options: argparse.Namespace, data: Any, lines: Sequence[str]) -> None:
    print(json.dumps(data) if options.json else '\n'.join(lines), flush=True)


def as_yaml(data: Any) -> str:
    """YAML as `ros2 topic echo` prints it."""
    return yaml.safe_dump(data, allow_unicode=True, sort_keys=False, width=10**6)


def from_yaml(text: str) -> Any:
    """A mapping typed on the command line; UserError where it is none."""
    try:
        data = yaml.load(text, Loader=_RosLoader) if text else {}
    except yaml.YAMLError as error:
        raise UserError(f'{text!r} is not YAML') from error
    if not isinstance(data, dict):
        raise UserError(f'{text!r} is no message; write fields as {{name: value, ...}}')
    return data


class _RosLoader(yaml.SafeLoader):
    """YAML as ROS reads parameters: 1e-3 is a number, 2026-01-31 and 1_000 are text.

    PyYAML follows YAML 1.1, in which a float needs a dot and 12:30 is a number.
    """


_RosLoader.yaml_implicit_resolvers = {
    first: [(tag, form) for tag, form in known if tag.rpartition(':')[2] not in _OURS]
    for first, known in yaml.SafeLoader.yaml_implicit_resolvers.items()
}
_RosLoader.add_implicit_resolver('tag:yaml.org,2002:float', _YAML_FLOAT, list('-+0123456789.'))
_RosLoader.add_implicit_resolver('tag:yaml.org,2002:int', _YAML_INT, list('-+0123456789'))
