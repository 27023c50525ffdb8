# SPDX-License-Identifier: Apache-2.0
"""`leo node`: who is in the graph."""

from typing import Any

from leo_msgs_py.errors import UserError
from leo_msgs_py.verbs import common

_LIST_EXAMPLES = '  leo node list\n  leo node list --all --json\n'
_INFO_EXAMPLES = '  leo node info /robot\n'
_SECTIONS = {
    'Subscribers': 'get_subscriber_names_and_types_by_node',
    'Publishers': 'get_publisher_names_and_types_by_node',
    'Service Servers': 'get_service_names_and_types_by_node',
    'Service Clients': 'get_client_names_and_types_by_node',
}


def main(argv: list[str]) -> int:
    verbs = {'list': _list, 'info': _info}
    examples = _LIST_EXAMPLES + _INFO_EXAMPLES
    return common.dispatch('leo node', 'Who is in the graph.', verbs, argv, examples)


def _list(argv: list[str]) -> int:
    parser = common.Parser('leo node list', 'List the nodes.', _LIST_EXAMPLES)
    parser.flag('-a --all', 'hidden ones too')
    options = parser.parse_args(argv)
    with common.probe() as node:
        found = names(node, hidden=options.all)
    if not found and not options.json:
        print(f'no nodes {common.where()}')
        return 1
    common.show(options, found, found)
    return 0


def _info(argv: list[str]) -> int:
    parser = common.Parser('leo node info', 'What a node offers and uses.', _INFO_EXAMPLES)
    parser.add('node', 'for example /robot')
    options = parser.parse_args(argv)
    with common.probe() as node:
        full = find(node, options.node)
        namespace, _, name = full.rpartition('/')
        data = {
            title: dict(getattr(node, query)(name, namespace or '/'))
            for title, query in _SECTIONS.items()
        }
    common.show(options, data, [full, *_lines(data)])
    return 0


def names(node: Any, hidden: bool = False) -> list[str]:
    """Full names of the nodes, sorted; without this process's own."""
    pairs = node.get_node_names_and_namespaces()
    own = (node.get_name(), node.get_namespace())
    return sorted(
        f'{namespace.rstrip("/")}/{name}'
        for name, namespace in pairs
        if (name, namespace) != own and (hidden or not name.startswith('_'))
    )


def find(node: Any, name: str) -> str:
    """Full name of a node that exists; UserError listing those there are otherwise."""
    full = common.absolute(name)
    there = names(node, hidden=True)
    if full not in there:
        listed = ', '.join(there) or f'none, {common.where()}'
        raise UserError(f'no node {full}; there are: {listed}')
    return full


def _lines(data: dict[str, dict[str, list[str]]]) -> list[str]:
    lines = []
    for title, entries in data.items():
        lines.append(f'  {title}:')
        lines += [f'    {name}: {", ".join(kinds)}' for name, kinds in entries.items()]
    return lines
