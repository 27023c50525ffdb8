# SPDX-License-Identifier: Apache-2.0
"""The tables of docs/architecture.md name the rooms that are there, and what each may import."""

import re
import subprocess
import sys
import tomllib

import pytest
from tests.architecture.source import HOMES, imports, MODULES, PRODUCT, room
from tests.places import ROOT

PAGE = (ROOT / 'docs/architecture.md').read_text()
PACKAGE = 'leo_diffmodel'


def rows(package: str) -> list[list[str]]:
    """The cells of the table of rooms of a package."""
    part = PAGE.partition(f'\n## {package}\n')[2].partition('\n## ')[0]
    lines = re.findall(r'^\| (`\w+` \|.*) \|$', part, flags=re.MULTILINE)
    return [line.split(' | ') for line in lines]


def rooms_in(package: str) -> set[str]:
    """The folders and modules at the top of a package, less the former names of modules."""
    folder = HOMES[package] / package
    files = {path.stem for path in folder.glob('*.py')} - {'__init__', 'model_file'}
    return files | {path.parent.name for path in folder.glob('*/__init__.py')}


def test_the_packages_are_in_their_order() -> None:
    assert tuple(re.findall(r'^\| `src/(\w+)` \|', PAGE, flags=re.MULTILINE)) == PRODUCT


def test_the_rooms_of_the_simulator_are_in_their_order() -> None:
    contracts = tomllib.loads((ROOT / 'pyproject.toml').read_text())['tool']['importlinter']
    (layers,) = (c['layers'] for c in contracts['contracts'] if c.get('containers') == ['leo_sim'])
    assert [cells[0].strip('`') for cells in rows('leo_sim')] == layers[::-1]


def test_rooms_import_what_the_page_says_they_may() -> None:
    allowed = {
        cells[0].strip('`'): set(re.findall(r'`(\w+)`', cells[1])) for cells in rows(PACKAGE)
    }
    assert set(allowed) == rooms_in(PACKAGE)
    modules = [m for m in MODULES if room(m, PACKAGE) in allowed]
    found = {
        (room(m, PACKAGE), other)
        for m in modules
        for other in {room(name, PACKAGE) for name in imports(MODULES[m].read_text(), m)}
        if other in allowed and other != room(m, PACKAGE)
    }
    assert sorted((here, other) for here, other in found if other not in allowed[here]) == []


@pytest.mark.parametrize('what', ['api', 'effects', 'faults'])
def test_pages_made_of_the_source_and_their_pictures_are_up_to_date(what: str) -> None:
    make = ROOT / f'docs/make_{what}.py'
    done = subprocess.run([sys.executable, str(make), '--check'], capture_output=True, text=True)
    assert (done.returncode, done.stdout) == (0, 'up to date\n'), done.stdout + done.stderr
