# SPDX-License-Identifier: Apache-2.0
"""The `--ros-args` of a command line: remaps, parameters, node name, namespace, log level."""

from __future__ import annotations

from dataclasses import dataclass, field
from fnmatch import fnmatchcase
from pathlib import Path
import re
from typing import Any

import yaml

from leo_msgs_py import ros_yaml
from leo_msgs_py.errors import UserError

LEVELS = ('debug', 'info', 'warn', 'error', 'fatal')
_SWITCHES = re.compile(r'--(?:enable|disable)-(?:rosout|stdout|external-lib)-logs')
_IGNORED = ('-e', '--enclave', '--log-config-file')
_RULE = re.compile(r'(?:(?P<node>\w+):)?(?P<from>[^:=]+):=(?P<to>.*)', re.DOTALL)


@dataclass
class RosArgs:
    """What the command line says about a node.

    Attributes:
        remaps: (from, to) rules of topics and services, in order.
        node: name given by `__node`, or None.
        namespace: namespace given by `__ns`, or None.
        parameters: overrides (node pattern, name, value), later ones win.
        log_level: one of `LEVELS`.
        rest: arguments that are not ROS's.
    """

    remaps: list[tuple[str, str]] = field(default_factory=list)
    node: str | None = None
    namespace: str | None = None
    parameters: list[tuple[str, str, Any]] = field(default_factory=list)
    log_level: str = 'info'
    rest: list[str] = field(default_factory=list)

    def overrides(self, full_name: str) -> dict[str, Any]:
        """Parameter values for the node with this full name."""
        return {n: v for pattern, n, v in self.parameters if _matches(pattern, full_name)}


def parse(args: list[str] | None, default_node: str) -> RosArgs:
    """Parse a command line without its program name.

    Args:
        args: the arguments; those outside `--ros-args ... [--]` come back as `rest`.
        default_node: node name that node-specific remap rules are matched against.

    Raises:
        UserError: an unknown flag, a rule without ':=', an unreadable parameter file.
    """
    result = RosArgs()
    words = iter(args or [])
    ros = False
    for word in words:
        if word == '--ros-args':
            ros = True
        elif ros and word == '--':
            ros = False
        elif ros and not _SWITCHES.fullmatch(word):
            _flag(word, _value(word, words), result, default_node)
        elif not ros:
            result.rest.append(word)
    return result


def _value(flag: str, words: Any) -> str:
    value = next(words, None)
    if value is None:
        raise UserError(f'--ros-args: {flag} needs a value')
    return str(value)


def _flag(flag: str, value: str, result: RosArgs, default_node: str) -> None:
    if flag in ('-p', '--param'):
        node, name, text = _rule(flag, value)
        result.parameters.append((node or '/**', name, _yaml(text, f'parameter {name}')))
    elif flag in ('-r', '--remap'):
        _remap(*_rule(flag, value), result, default_node)
    elif flag == '--params-file':
        result.parameters += read_params_file(Path(value))
    elif flag == '--log-level':
        result.log_level = _level(value)
    elif flag not in _IGNORED:
        raise UserError(
            f'--ros-args: unknown {flag!r}; known are -p, -r, --params-file, --log-level'
        )


def _rule(flag: str, text: str) -> tuple[str | None, str, str]:
    found = _RULE.fullmatch(text)
    if not found:
        raise UserError(f'--ros-args: {flag} {text!r} must be name:=value')
    return found['node'], found['from'], found['to']


def _remap(node: str | None, name: str, to: str, result: RosArgs, default_node: str) -> None:
    if node not in (None, default_node):
        return
    if name in ('__node', '__name'):
        result.node = to
    elif name == '__ns':
        result.namespace = to if to.startswith('/') else f'/{to}'
    else:
        result.remaps.append((name, to))


def _level(text: str) -> str:
    level = text.rpartition(':=')[2].lower()
    if level not in LEVELS:
        raise UserError(f'--log-level {text!r} is none of {", ".join(LEVELS)}')
    return level


def _yaml(text: str, what: str) -> Any:
    try:
        return ros_yaml.load(text)
    except yaml.YAMLError as error:
        raise UserError(f'{what}: {text!r} is not YAML') from error


def read_params_file(path: Path) -> list[tuple[str, str, Any]]:
    """(node pattern, parameter, value) of a ROS parameter file, in order.

    Raises:
        UserError: the file is missing, no YAML, or has no `ros__parameters`.
    """
    try:
        tree = _yaml(path.read_text(), f'parameter file {path}')
    except OSError as error:
        raise UserError(f'parameter file {path} cannot be read: {error.strerror}') from error
    found: list[tuple[str, str, Any]] = []
    _nodes(tree, '', found)
    if not found:
        raise UserError(f'parameter file {path} has no node with ros__parameters')
    return found


def _nodes(tree: Any, path: str, found: list[tuple[str, str, Any]]) -> None:
    if not isinstance(tree, dict):
        return
    for key, value in tree.items():
        if key == 'ros__parameters':
            found += [(path, name, leaf) for name, leaf in _leaves(value, '')]
        else:
            _nodes(value, f'{path}/{str(key).strip("/")}', found)


def _leaves(tree: Any, prefix: str) -> list[tuple[str, Any]]:
    if not isinstance(tree, dict):
        return [(prefix, tree)]
    return [
        leaf
        for key, value in tree.items()
        for leaf in _leaves(value, f'{prefix}.{key}' if prefix else str(key))
    ]


def _matches(pattern: str, full_name: str) -> bool:
    """Whether a node pattern means the node: '/**' any, '*' one token, bare names too."""
    if '/' not in pattern:
        return full_name.rpartition('/')[2] == pattern
    if pattern.startswith('/**'):
        tail = pattern[3:]
        return full_name.endswith(tail) if tail else True
    same_depth = pattern.count('/') == full_name.count('/')
    return same_depth and fnmatchcase(full_name, pattern)
