# SPDX-License-Identifier: Apache-2.0
"""The size of the source by room, and the budget of lines, which only falls.

python benchmarks/house.py                     what there is
python benchmarks/house.py --against COMMIT    beside what a commit had
python benchmarks/house.py --keep              lower benchmarks/house.yaml to what there is
"""

import argparse
import ast
from collections import Counter
from collections.abc import Iterator
import io
from pathlib import Path
import re
import subprocess
import sys
import tarfile
import tempfile

from rich.console import Console
from rich.table import Table
import yaml

ROOT = Path(__file__).parents[1]
BUDGET = ROOT / 'benchmarks/house.yaml'
COLUMNS = ('lines', 'files', 'functions', 'long', 'numbers', 'words')
LONG = 15
"""Lines of a function that count as many."""
PRIVATE = re.compile(
    r'heard|turns?|mine|own|anew|stands?|standing|trifle|widens?|lacks?|errand|tape|spoil|wild|begins?'
)
"""Words of this project that no textbook has for what they name here."""


def rooms(root: Path) -> dict[str, Counter[str]]:
    """What each room of src, and the tests as one, hold."""
    found: dict[str, Counter[str]] = {}
    for top in ('src', 'tests'):
        for path in sorted((root / top).rglob('*.py')):
            found.setdefault(_room(path.relative_to(root)), Counter()).update(_counts(path))
    return found


def _room(path: Path) -> str:
    if path.parts[0] == 'tests':
        return 'tests'
    package, *inside = path.parts[1:-1]
    return '/'.join([package, *inside[1:2]])


def _counts(path: Path) -> Counter[str]:
    source = path.read_text()
    nodes = list(ast.walk(ast.parse(source)))
    functions = [n for n in nodes if isinstance(n, ast.FunctionDef | ast.AsyncFunctionDef)]
    counts = {
        'lines': source.count('\n'),
        'files': 1,
        'functions': len(functions),
        'long': sum(_length(f) > LONG for f in functions),
        'numbers': sum(_numbers(nodes)) if 'settings' in str(path) else 0,
        'words': sum(map(_private, nodes)),
    }
    return Counter(counts)


def _length(function: ast.FunctionDef | ast.AsyncFunctionDef) -> int:
    first = (
        function.body[1] if ast.get_docstring(function) and function.body[1:] else function.body[0]
    )
    return (function.end_lineno or 0) - first.lineno + 1


def _numbers(nodes: list[ast.AST]) -> Iterator[bool]:
    for node in nodes:
        if isinstance(node, ast.AnnAssign) and node.value:
            held = [n.value for n in ast.walk(node.value) if isinstance(n, ast.Constant)]
            yield any(type(value) in (int, float) for value in held)


def _private(node: ast.AST) -> bool:
    name = (
        getattr(node, 'name', None) if isinstance(node, ast.stmt) else getattr(node, 'arg', None)
    )
    return isinstance(name, str) and any(map(PRIVATE.fullmatch, name.split('_')))


def of_commit(commit: str) -> dict[str, Counter[str]]:
    """The same of a commit."""
    packed = subprocess.run(
        ['git', 'archive', commit, 'src', 'tests'], cwd=ROOT, capture_output=True, check=True
    )
    with tempfile.TemporaryDirectory() as folder:
        with tarfile.open(fileobj=io.BytesIO(packed.stdout)) as archive:
            archive.extractall(folder, filter='data')
        return rooms(Path(folder))


def sums(found: dict[str, Counter[str]]) -> dict[str, int]:
    """Lines of all rooms of src, and of the tests."""
    tests = found['tests']['lines']
    return {'src': sum(c['lines'] for c in found.values()) - tests, 'tests': tests}


def shown(now: dict[str, Counter[str]], before: dict[str, Counter[str]]) -> Table:
    """A row for each room, with what it had before."""
    table = Table('room', *COLUMNS, box=None)
    table.columns[0].no_wrap = True
    rows = {**now, 'src': sum((c for r, c in now.items() if r != 'tests'), Counter())}
    past = {**before, 'src': sum((c for r, c in before.items() if r != 'tests'), Counter())}
    for room in sorted({*rows, *(past if before else ())}):
        cells = [str(rows.get(room, Counter())[column]) for column in COLUMNS]
        if before:
            old = past.get(room, Counter())
            cells = [f'{old[c]} -> {cell}' for c, cell in zip(COLUMNS, cells, strict=True)]
        table.add_row(room, *cells)
    return table


def keep(found: dict[str, Counter[str]]) -> str:
    """Write the budget where no sum has grown.

    Returns: what is wrong, '' where it was written.
    """
    budget, now = yaml.safe_load(BUDGET.read_text()), sums(found)
    grown = [name for name in now if now[name] > budget[name]]
    if grown:
        return f'{" and ".join(grown)} grew: {now}, and the budget is {budget}'
    head = [line for line in BUDGET.read_text().splitlines() if line.startswith('#')]
    BUDGET.write_text('\n'.join([*head, yaml.safe_dump(now)]))
    return ''


def main() -> str:
    """Print, or keep."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument('--against', metavar='COMMIT', help='print beside what a commit had')
    parser.add_argument('--keep', action='store_true', help='lower the budget to what there is')
    options = parser.parse_args()
    now = rooms(ROOT)
    Console(width=120).print(shown(now, of_commit(options.against) if options.against else {}))
    return keep(now) if options.keep else ''


if __name__ == '__main__':
    sys.exit(main() or None)
