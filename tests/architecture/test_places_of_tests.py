# SPDX-License-Identifier: Apache-2.0
"""Where a test lies (CONTRIBUTING.md): the tree under tests/unit is that of the source."""

import ast
from pathlib import Path

import pytest
from tests.architecture.source import HOMES, imports, within
from tests.places import ROOT, TESTS

FILES = [path.relative_to(TESTS) for path in sorted(TESTS.rglob('test_*.py'))]
KINDS = ('architecture', 'unit', 'integration', 'property', 'graph', 'e2e')
REAL_TIME = Path('graph/test_dynamixel_graph.py')
"""A bus that has to be answered in time; its tests are all slow."""


def misplaced(file: Path, source: str) -> str:
    """Say what is wrong with the place of a test, a path from tests/; '' if nothing is."""
    kind, *rooms = file.parts[:-1] or ('',)
    if kind not in KINDS:
        return f'tests/{kind} is no kind of test'
    if kind != 'unit':
        return f'the tests of tests/{kind} lie in no folders' if rooms else ''
    if not rooms or rooms[0] not in HOMES:
        return 'a test under tests/unit lies in the folder of a package'
    if not HOMES[rooms[0]].joinpath(*rooms).is_dir():
        return f'the source has no folder {"/".join(rooms)}'
    room = '.'.join(rooms)
    loads = any(within(name, room) for name in imports(source, 'tests'))
    return '' if loads else f'imports nothing of {room}'


def test_a_test_lies_where_its_source_does() -> None:
    found = {file: misplaced(file, (TESTS / file).read_text()) for file in FILES}
    assert {file: wrong for file, wrong in found.items() if wrong} == {}


@pytest.mark.parametrize(
    ('file', 'source', 'said'),
    [
        ('test_bags.py', '', 'no kind of test'),
        ('slow/test_bags.py', '', 'no kind of test'),
        ('e2e/leo_sim/test_demo.py', '', 'in no folders'),
        ('unit/test_bags.py', 'import leo_diffmodel.bags', 'the folder of a package'),
        ('unit/bags/test_zoh.py', 'import leo_diffmodel.bags', 'the folder of a package'),
        ('unit/leo_sim/bags/test_zoh.py', 'import leo_sim', 'no folder leo_sim/bags'),
        ('unit/leo_sim/truth/test_draw.py', 'import leo_sim.truths', 'nothing of leo_sim.truth'),
    ],
)
def test_another_place_is_noticed(file: str, source: str, said: str) -> None:
    assert said in misplaced(Path(file), source)


def test_the_kinds_are_those_that_contributing_explains() -> None:
    page = (ROOT / 'CONTRIBUTING.md').read_text()
    assert [kind for kind in KINDS if f'`tests/{kind}`' not in page] == []
    assert {file.parts[0] for file in FILES} == set(KINDS)


def slow_as_a_whole(source: str) -> bool:
    """Whether a whole test or file is marked slow, not some cases of a test."""
    tree = ast.parse(source)
    decorators = [
        mark
        for node in ast.walk(tree)
        if isinstance(node, ast.FunctionDef | ast.ClassDef)
        for mark in node.decorator_list
    ]
    of_files = [
        node.value
        for node in tree.body
        if isinstance(node, ast.Assign) and ast.unparse(node.targets[0]) == 'pytestmark'
    ]
    slow = 'pytest.mark.slow'
    return slow in map(ast.unparse, decorators) or any(slow in ast.unparse(m) for m in of_files)


def test_what_is_slow_is_a_case_of_a_test_that_stays() -> None:
    assert [f for f in FILES if slow_as_a_whole((TESTS / f).read_text())] == [REAL_TIME]


@pytest.mark.parametrize(
    'source',
    [
        '@pytest.mark.slow\ndef test_a():\n    pass',
        'pytestmark = pytest.mark.slow',
        'pytestmark = [pytest.mark.graph, pytest.mark.slow]',
    ],
)
def test_a_test_without_a_quick_case_is_noticed(source: str) -> None:
    assert slow_as_a_whole(source)
