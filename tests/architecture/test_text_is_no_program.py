# SPDX-License-Identifier: Apache-2.0
"""What is read from files, bags and messages is never text of a program, read from the source."""

import ast
from collections.abc import Iterator
import re

import pytest
from tests.architecture.source import imports, MODULES

RUN = (
    'exec',
    'eval',
    'compile',
    '__import__',
    'os.system',
    'os.popen',
    'torch.load',
    'yaml.load',
    'yaml.unsafe_load',
    'yaml.full_load',
    'importlib.util.spec_from_file_location',
)
"""Functions that run a text, or can."""
LOADERS = ('pickle', 'marshal', 'shelve', 'dill', 'runpy', 'importlib.import_module')
"""What makes objects or modules of what a file says."""
ALLOWED = {
    'leo_sim.common.user_code': {'importlib.util.spec_from_file_location'},
    'leo_msgs_py.interfaces': {'importlib.import_module'},
    'leo_msgs_py.verbs.common': {'yaml.load'},
    'leo_sim.common.yaml_file': {'yaml.load'},
}
"""A user's file of effects or a driver, which he names; installed interfaces; a safe loader."""
FIELD = '\0'
TYPED = re.compile(rf'\bleo [a-z-]+(?: [-\w]+)* {FIELD}')
"""A command with a word that is put in: that is left to `shell_words.leo`, which quotes."""
TAG = re.compile(r'</?(?:a|b|br|code|div|i|li|p|small|span|td|tr|ul)\b[ />]')


def runs(module: str, source: str) -> set[str]:
    """Name what a module has that makes a program of a text."""
    calls = [n for n in ast.walk(ast.parse(source)) if isinstance(n, ast.Call)]
    return {
        *(set(imports(source, module)) & set(LOADERS)),
        *({ast.unparse(call.func) for call in calls} & set(RUN)),
        *(
            f'{k.arg}=True'
            for call in calls
            for k in call.keywords
            if k.arg in ('shell', 'allow_pickle') and ast.unparse(k.value) != 'False'
        ),
    }


def put_in(source: str, pattern: re.Pattern[str]) -> list[str]:
    """The f-strings that have a pattern, what is put in written as FIELD."""
    strings = [n for n in ast.walk(ast.parse(source)) if isinstance(n, ast.JoinedStr)]
    said = [
        ''.join(
            str(part.value) if isinstance(part, ast.Constant) else FIELD for part in string.values
        )
        for string in strings
    ]
    return [text for text in said if FIELD in text and pattern.search(text)]


def sources() -> Iterator[tuple[str, str]]:
    """Every module with its text."""
    return ((module, path.read_text()) for module, path in MODULES.items())


def test_no_text_becomes_a_program() -> None:
    found = {m: runs(m, source) - ALLOWED.get(m, set()) for m, source in sources()}
    assert {m: names for m, names in found.items() if names} == {}


@pytest.mark.parametrize('pattern', [TYPED, TAG], ids=['commands', 'HTML'])
def test_what_is_put_into_commands_and_html_is_held_to_be_words(pattern: re.Pattern[str]) -> None:
    """Commands to type are made by `shell_words.leo`, HTML by templates or `Markup`."""
    found = {module: put_in(source, pattern) for module, source in sources()}
    assert {module: texts for module, texts in found.items() if texts} == {}


@pytest.mark.parametrize(
    'source',
    [
        'exec(text)',
        'eval(text)',
        "compile(text, 'x', 'exec')",
        "run(['a'], shell=True)",
        'np.load(file, allow_pickle=True)',
        'torch.load(file)',
        'yaml.load(text)',
        "importlib.util.spec_from_file_location('a', path)",
    ],
)
def test_a_program_is_noticed(source: str) -> None:
    assert runs('leo_sim.model.model', source)


def test_a_word_that_is_not_quoted_is_noticed() -> None:
    assert put_in("f'next: leo bag info {path}'", TYPED)
    assert put_in("f'or: leo add {model} {words} -o x'", TYPED)
    assert not put_in("f'leo add: {path} is none'", TYPED)


def test_html_by_hand_is_noticed() -> None:
    assert put_in("f'<b>{name}</b>'", TAG) and put_in("f'{name}<br>'", TAG)
    assert not put_in("f'{a} < {b}'", TAG)
