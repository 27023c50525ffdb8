# SPDX-License-Identifier: Apache-2.0
"""Every number of explain is a setting, with its unit and its reason (docs/evidence.md)."""

import ast
import re

import pytest
from tests.architecture.source import imports, MODULES, of_rooms

EXPLAIN = 'leo_diffmodel.explain'
SETTINGS = f'{EXPLAIN}.settings'


def numbers(source: str) -> list[str]:
    """Names at the top of a module that hold numbers, or what the settings were at import."""
    made = [
        (node.targets if isinstance(node, ast.Assign) else [node.target], node.value)
        for node in ast.parse(source).body
        if isinstance(node, ast.Assign | ast.AnnAssign) and node.value
    ]
    return [
        ast.unparse(target)
        for targets, value in made
        if any(map(_is_number, ast.walk(value)))
        for target in targets
    ]


def _is_number(node: ast.AST) -> bool:
    named = node.attr if isinstance(node, ast.Attribute) else getattr(node, 'id', '')
    return named in ('SETTINGS', 'pi', 'e', 'inf', 'nan') or (
        isinstance(node, ast.Constant) and type(node.value) in (int, float)
    )


def test_all_numbers_of_explain_are_settings_that_travel_with_the_problem() -> None:
    """Nor is a default anything but at the two doors, where a problem is posed."""
    modules = of_rooms('leo_diffmodel', ('explain',))
    sources = {m: MODULES[m].read_text() for m in modules if not m.startswith(SETTINGS)}
    found = {module: numbers(source) for module, source in sources.items()}
    assert {module: names for module, names in found.items() if names} == {}
    defaults = {f'{SETTINGS}.{name}' for name in ('SETTINGS', 'settings_for')}
    doors = {
        module
        for module, source in sources.items()
        if defaults.intersection(imports(source, module))
    }
    assert doors == {f'{EXPLAIN}.explanation', f'{EXPLAIN}.problem.pose'}


@pytest.mark.parametrize(
    'source',
    [
        'HUBER = 2.5',
        'MOST, SCALES = 4, (1.0, 0.3)',
        'RIDGE: float = -1e-9',
        'TURN = np.pi',
        'NEARBY = np.linspace(-1.0, 1.0, 33)',
        'MARGIN = SETTINGS.gates.margin_nats',
        "WIDTHS = {'narrow': 0.1}",
        'STILL = Motor(0.0, 0.0)',
    ],
)
def test_a_number_at_the_top_of_a_module_is_noticed(source: str) -> None:
    assert numbers(source)


@pytest.mark.parametrize(
    'source',
    [
        "NAMES = ('q', 'dq')",
        'Array = np.ndarray',
        'def f():\n    most = 3',
        'TRUE = True',
        '_started: list[Future] = []',
    ],
)
def test_texts_and_types_are_no_numbers(source: str) -> None:
    assert numbers(source) == []


def test_every_number_of_explain_is_read() -> None:
    texts = ''.join(MODULES[m].read_text() for m in of_rooms('leo_diffmodel', ('explain',)))
    read = set(re.findall(r'\.(\w+)', texts))
    tables = [MODULES[f'{SETTINGS}.{part}'] for part in ('gates', 'numerics', 'grids')]
    kept = [
        ast.unparse(n.target)
        for path in tables
        for n in ast.walk(ast.parse(path.read_text()))
        if isinstance(n, ast.AnnAssign)
    ]
    assert len(kept) > 100 and [name for name in kept if name not in read] == []
