# SPDX-License-Identifier: Apache-2.0
"""`leo service`: list and call services."""

from typing import Any

from leo_msgs_py.errors import UserError
from leo_msgs_py.interfaces import fill, load, to_plain
from leo_msgs_py.verbs import common

_LIST_EXAMPLES = '  leo service list -t\n'
_CALL_EXAMPLES = (
    '  leo service call /robot/reset\n'
    "  leo service call /robot/torque std_srvs/srv/SetBool '{data: true}'\n"
)


def main(argv: list[str]) -> int:
    verbs = {'list': _list, 'call': _call}
    examples = _LIST_EXAMPLES + _CALL_EXAMPLES
    return common.dispatch('leo service', 'List and call services.', verbs, argv, examples)


def _list(argv: list[str]) -> int:
    return common.list_typed(argv, 'service', _LIST_EXAMPLES, _others, 'List the services.')


def _others(node: Any) -> common.Pairs:
    own = f'/{node.get_name()}/'
    return [s for s in node.get_service_names_and_types() if not s[0].startswith(own)]


def _call(argv: list[str]) -> int:
    """Exit status 1 for an answer whose `success` is false."""
    parser = common.Parser('leo service call', 'Call a service.', _CALL_EXAMPLES)
    parser.add_argument('service')
    parser.add('type', 'type; found out where left away', nargs='?')
    parser.add('values', 'fields of the request as YAML', nargs='?', default='')
    parser.add('--timeout', 'wait so long [s]', default=10.0)
    options = parser.parse_args(argv)
    if options.type and '/' not in options.type:
        options.type, options.values = None, options.type
    from leo_msgs_py.node import call

    with common.probe(settled=False) as node:
        service = common.absolute(options.service)
        if not options.type:
            common.settle(node)
            options.type = common.one_type(service, node.get_service_names_and_types(), 'service')
        srv_type = load(options.type, 'srv')
        request = fill(srv_type.Request(), common.from_yaml(options.values))
        client = node.create_client(srv_type, service)
        try:
            response = call(client, request, options.timeout)
        except TimeoutError as error:
            raise UserError(f'{error}; is its node still running?') from error
    data = to_plain(response)
    common.show(options, data, [common.as_yaml(data).rstrip()])
    return 1 if data.get('success') is False else 0
