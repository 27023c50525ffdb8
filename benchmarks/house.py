# SPDX-License-Identifier: Apache-2.0
"""Counts of this project's source trees: floors, circles, importers, `Any`, lines.

    git worktree add ../before 41d7e69
    python benchmarks/house.py . ../before

A module's floor is the longest chain of imports below it, where modules that import each other in
a circle are on one floor. Imports inside functions and for types alone count, too; `__init__.py`
stands for its package. An argument counts as `Any` where that is its whole annotation.
"""

from __future__ import annotations

import ast
from collections import Counter
from collections.abc import Iterator
from pathlib import Path
import sys

import networkx as nx
from rich.console import Console
from rich.table import Table

PACKAGES = ('leo_msgs_py', 'leo_sim', 'leo_diffmodel', 'leo_learner')
Modules = dict[str, ast.Module]


def read(tree: Path) -> Modules:
    """The parsed modules of the four packages by their dotted names."""
    found = {}
    for package in PACKAGES:
        root = tree / 'src' / package
        for path in sorted((root / package).rglob('*.py')):
            parts = path.relative_to(root).with_suffix('').parts
            found['.'.join(parts).removesuffix('.__init__')] = ast.parse(path.read_text())
    return found


def imported(name: str, known: Modules) -> Iterator[str]:
    """The modules of ours that one imports; `from a import b` is of a.b where that is a module."""
    is_package = any(other.startswith(f'{name}.') for other in known)
    inside = [*name.split('.'), *(['__init__'] if is_package else [])]
    for node in ast.walk(known[name]):
        if isinstance(node, ast.Import):
            yield from (alias.name for alias in node.names if alias.name in known)
        elif isinstance(node, ast.ImportFrom):
            above = inside[: -node.level] if node.level else []
            base = '.'.join([*above, *filter(None, [node.module])])
            names = [f'{base}.{alias.name}' for alias in node.names]
            yield from (n if n in known else base for n in names)


def graph(modules: Modules) -> nx.DiGraph:
    """An edge from each module to those it imports."""
    edges = nx.DiGraph()
    edges.add_nodes_from(modules)
    for name in modules:
        names = set(imported(name, modules)) & set(modules) - {name}
        edges.add_edges_from((name, n) for n in names)
    return edges


def of_rooms(edges: nx.DiGraph) -> nx.DiGraph:
    """Those of the folders and files that lie at the top of their package."""
    room = {name: '.'.join(name.split('.')[:2]) for name in edges}
    rooms = nx.DiGraph()
    rooms.add_nodes_from(r for r in room.values() if '.' in r)
    rooms.add_edges_from((room[a], room[b]) for a, b in edges.edges if room[a] != room[b])
    return rooms


def floors(edges: nx.DiGraph) -> int:
    """How many floors the modules stand on."""
    return int(nx.dag_longest_path_length(nx.condensation(edges))) + 1


def circles(edges: nx.DiGraph) -> list[set[str]]:
    """Groups of modules that import each other in a circle."""
    return [c for c in nx.strongly_connected_components(edges) if len(c) > 1]


def arguments(modules: Modules) -> Iterator[str]:
    """The annotation of every annotated argument."""
    for module in modules.values():
        for node in ast.walk(module):
            if isinstance(node, ast.arg) and node.annotation is not None:
                yield ast.unparse(node.annotation)


def counts(tree: Path, package: str) -> dict[str, int]:
    """The figures of one package, or of all where it is ''."""
    everything = read(tree)
    modules = {n: m for n, m in everything.items() if n.split('.')[0] == package or not package}
    edges = graph(everything)
    inside = edges.subgraph(modules)
    annotated = Counter(arguments(modules))
    files = [
        p
        for one in ([package] if package else PACKAGES)
        for p in (tree / 'src' / one / one).rglob('*.py')
    ]
    lines = sum(len(p.read_text().splitlines()) for p in files)
    return {
        'modules': len(modules),
        'files and folders at its top': len(of_rooms(inside)),
        'floors of these': floors(of_rooms(inside)),
        'lines': lines,
        'floors of modules': floors(inside),
        'circles of modules': len(circles(inside)),
        'with one importer': sum(edges.in_degree(n) == 1 for n in modules),
        'arguments': annotated.total(),
        'of them Any': annotated['Any'],
    }


def main() -> None:
    """Print the figures of the trees given, side by side."""
    trees = [Path(word) for word in sys.argv[1:]] or [Path()]
    table = Table('package', 'count', *(str(tree) for tree in trees))
    for package in (*PACKAGES, ''):
        columns = [counts(tree, package) for tree in trees]
        for what in columns[0]:
            table.add_row(
                package or 'all four',
                what,
                *(str(c[what]) for c in columns),
                end_section=what == 'of them Any',
            )
    Console(width=120).print(table)
    for tree in trees:
        for circle in circles(graph(read(tree))):
            print(f'{tree}: in a circle: {", ".join(sorted(circle))}')


if __name__ == '__main__':
    main()
