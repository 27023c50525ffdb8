# SPDX-License-Identifier: Apache-2.0
"""What the pages tell to type and to open, and what docs/architecture.md names, is there."""

from contextlib import redirect_stdout
from functools import cache
from importlib.metadata import entry_points
import io
from pathlib import Path
import re

import pytest
from tests.places import ROOT

from leo_msgs_py.cli import main

README = (ROOT / 'README.md').read_text()
PAGES = [*sorted(ROOT.glob('*.md')), *sorted(ROOT.glob('docs/**/*.md'))]
NOW = [page.read_text() for page in PAGES if page.name != 'CHANGELOG.md']
"""What is so now; the changes tell of what was."""
BLOCK = re.compile(r'^```(?:\w*)\n(.*?)^```', re.DOTALL | re.MULTILINE)
COMMAND = re.compile(r'^(?:\$ )?(leo .*)', re.MULTILINE)
PATH = re.compile(r'`((?:src|tests|docs|benchmarks)/[^`* ]+)`')
BLOCKS = [block.replace('\\\n', '') for text in NOW for block in BLOCK.findall(text)]
COMMANDS = sorted({typed.strip() for block in BLOCKS for typed in COMMAND.findall(block)})
PATHS = sorted({path for text in NOW for path in PATH.findall(text)})
ARCHITECTURE = (ROOT / 'docs/architecture.md').read_text()
WHERE_IS = ARCHITECTURE.partition('## Where is')[2]


@cache
def shown(*verbs: str) -> set[str]:
    said = io.StringIO()
    with redirect_stdout(said), pytest.raises(SystemExit, match=r'^0$'):
        main([*verbs, '--help'])
    return set(re.findall(r'--?[a-z][a-z-]*', said.getvalue()))


def test_readme_has_commands() -> None:
    assert len(COMMANDS) > 100 and README.count('\nleo ') > 8


@pytest.mark.parametrize('command', COMMANDS)
def test_command_exists_with_its_options(command: str) -> None:
    words = re.split(r'\s{2,}| #| --ros-args', command)[0].split()
    verbs = set(words[1].split('|'))
    assert verbs <= {entry.name for entry in entry_points(group='leo.verbs')}
    options = {w for w in words if re.fullmatch(r'--?[a-z][a-z-]*', w)}
    if not options <= (shown(*verbs) if options else set()):
        assert options <= shown(*words[1:3])  # those of `leo topic pub`


@pytest.mark.parametrize('path', PATHS)
def test_path_exists(path: str) -> None:
    assert (ROOT / path).exists()


@pytest.mark.parametrize('page', PAGES, ids=lambda p: str(p.relative_to(ROOT)))
def test_pictures_and_links_exist(page: Path) -> None:
    text = re.sub(r'```.*?```', '', page.read_text(), flags=re.DOTALL)
    linked = re.findall(r'\]\(([^)#\s]+)(?:#[^)]*)?\)', text)
    here = [p for p in linked if not p.startswith('http')]
    assert [p for p in here if not (page.parent / p).exists()] == []


ANSWERS = dict(re.findall(r'^\| ([^|]+?) \| (.*\]\(.*) \|$', WHERE_IS, flags=re.MULTILINE))


def test_ten_questions_have_answers() -> None:
    assert len(ANSWERS) >= 10 and '(docs/architecture.md)' in README


@pytest.mark.parametrize('question', ANSWERS)
def test_answer_names_what_its_files_hold(question: str) -> None:
    linked = re.findall(r'\]\(([^)]+)\)', ANSWERS[question])
    files = [path for link in linked if (path := ROOT / 'docs' / link).is_file()]
    text = '\n'.join(path.read_text() for path in files)
    beside = {path.name for file in files for path in file.parent.iterdir()}
    for name in re.findall(r'(?<!\[)`(\w+)`', ANSWERS[question]):
        assert name in beside or re.search(rf'\b(def|class) {name}\b', text), name


def test_architecture_names_files_that_are_there() -> None:
    named = set(re.findall(r'`([a-z_]\w*(?:/\w+)*\.py)`', ARCHITECTURE))
    there = [str(path) for path in (ROOT / 'src').rglob('*.py')]
    there += [str(path) for path in ROOT.glob('[bt]*/**/*.py')]
    assert sorted(n for n in named if not any(t.endswith(f'/{n}') for t in there)) == []
