# SPDX-License-Identifier: Apache-2.0
"""`leo param`: list, get and set the parameters of nodes."""

from typing import Any

from leo_msgs_py.errors import UserError
from leo_msgs_py.interfaces import to_plain
from leo_msgs_py.verbs import common
from leo_msgs_py.verbs import node as node_verb

_LIST_EXAMPLES = '  leo param list\n  leo param list /robot\n'
_GET_EXAMPLES = '  leo param get /robot realtime_factor\n'
_SET_EXAMPLES = '  leo param set /my_node gain 0.5\n'
_TIMEOUT_S = 5.0


def main(argv: list[str]) -> int:
    verbs = {'list': _list, 'get': _get, 'set': _set}
    examples = _LIST_EXAMPLES + _GET_EXAMPLES + _SET_EXAMPLES
    description = 'List, get and set the parameters of nodes.'
    return common.dispatch('leo param', description, verbs, argv, examples)


def _list(argv: list[str]) -> int:
    parser = common.Parser('leo param list', 'List parameters.', _LIST_EXAMPLES)
    parser.add('node', 'for example /robot; all where left away', nargs='?')
    options = parser.parse_args(argv)
    with common.probe() as node:
        wanted = [node_verb.find(node, options.node)] if options.node else node_verb.names(node)
        found = {name: _names(node, name) for name in wanted}
    lines = [line for name, ps in found.items() for line in (f'{name}:', *(f'  {p}' for p in ps))]
    common.show(options, found, lines)
    return 0


def _get(argv: list[str]) -> int:
    parser = common.Parser('leo param get', 'Print a parameter.', _GET_EXAMPLES)
    parser.add_argument('node')
    parser.add_argument('parameter')
    options = parser.parse_args(argv)
    with common.probe() as node:
        name = node_verb.find(node, options.node)
        from rcl_interfaces.srv import GetParameters
        from rclpy.parameter import parameter_value_to_python

        request = GetParameters.Request(names=[options.parameter])
        response = _ask(node, name, GetParameters, 'get_parameters', request)
        if not len(response.values) or not response.values[0].type:
            raise _unknown(node, name, options.parameter)
        value = to_plain(parameter_value_to_python(response.values[0]))
    common.show(options, value, [common.as_yaml(value).removesuffix('...\n').rstrip()])
    return 0


def _set(argv: list[str]) -> int:
    parser = common.Parser('leo param set', 'Set a parameter.', _SET_EXAMPLES, json=False)
    parser.add_argument('node')
    parser.add_argument('parameter')
    parser.add('value', 'as YAML: 1, 1.5, true, text, [1, 2]')
    options = parser.parse_args(argv)
    with common.probe() as node:
        name = node_verb.find(node, options.node)
        if options.parameter not in _names(node, name):
            raise _unknown(node, name, options.parameter)
        from rcl_interfaces.msg import Parameter
        from rcl_interfaces.srv import SetParameters
        from rclpy.parameter import get_parameter_value

        parameter = Parameter(name=options.parameter, value=get_parameter_value(options.value))
        request = SetParameters.Request(parameters=[parameter])
        (result,) = _ask(node, name, SetParameters, 'set_parameters', request).results
    if not result.successful:
        raise UserError(f'{name} refused: {result.reason}')
    print(f'{name}: {options.parameter} = {options.value}')
    return 0


def _names(node: Any, name: str) -> list[str]:
    from rcl_interfaces.srv import ListParameters

    response = _ask(node, name, ListParameters, 'list_parameters', ListParameters.Request())
    return sorted(response.result.names)


def _unknown(node: Any, name: str, parameter: str) -> UserError:
    there = ', '.join(_names(node, name))
    return UserError(f'{name} has no parameter {parameter!r}; it has: {there}')


def _ask(node: Any, name: str, kind: Any, service: str, request: Any) -> Any:
    from leo_msgs_py.node import call

    client = node.create_client(kind, f'{name}/{service}')
    try:
        return call(client, request, _TIMEOUT_S)
    except TimeoutError as error:
        raise UserError(f'{name} serves no parameters: {error}') from error
    finally:
        node.destroy_client(client)
