# SPDX-License-Identifier: Apache-2.0
"""Names from files, bags and messages are shown on the terminal, and never obeyed by it."""

import io
import json
from pathlib import Path
import re
import subprocess
import sys

from mcap.writer import Writer
import pytest
from rich.table import Table
from rich.text import Text
from tests.commands import CODE
from tests.hostile_names import SHELL
from tests.places import ROOT
from tests.robots import like
import yaml

from leo_diffmodel.bags.types import definition, JOINT_STATE
from leo_msgs_py import cli
from leo_msgs_py.cdr import joint_state
from leo_msgs_py.console import Terminal
from leo_msgs_py.errors import UserError
from leo_msgs_py.terminal import leo, Output, visible
from leo_sim.description.robot import load_robot

HARM = '\x1b]0;owned\x07\x1b[2J\x9b31m[bold]x[/red]\u202e'
SPELT = r'\x1b]0;owned\x07\x1b[2J\x9b31m[bold]x[/red]\u202e'
OBEYED = re.compile('[\x00-\x08\x0b-\x1f\x7f-\x9f\u202a-\u202e]')
FILE = HARM.replace('/', '')
SHOW = 'leo() { printf "%s\\n" "$@"; }\n'


@pytest.mark.parametrize(
    ('text', 'shown'),
    [
        ('pivot [rad] é ▁ \n\t', 'pivot [rad] é ▁ \n\t'),
        (HARM, SPELT),
        ('a\rb', r'a\rb'),
        ('\udcff.csv', r'\udcff.csv'),
        ('a\u2066b\u2069', r'a\u2066b\u2069'),
    ],
)
def test_what_is_obeyed_is_spelt_out(text, shown):
    assert visible(text) == shown


def test_print_spells_out_and_says_what_it_is(capsys):
    stream = io.StringIO()
    print(HARM, file=Output(stream))
    assert stream.getvalue() == f'{SPELT}\n' and not Output(stream).isatty()


def test_a_table_shows_names_and_keeps_its_colours():
    stream = io.StringIO()
    console = Terminal(file=stream, force_terminal=True, width=200, color_system='standard')
    table = Table('joint [rad]', title=HARM)
    table.add_row(HARM)
    console.print(table)
    console.print(Text.assemble((HARM, 'bold'), ' :smile:'))
    console.print(HARM)
    said = re.sub(r'\x1b\[[0-9;]*m', '', stream.getvalue())
    assert said != stream.getvalue()
    assert not OBEYED.search(said)
    assert said.count(SPELT) == 3 and said.count(SPELT.replace(r'\x07', '')) == 1
    assert 'joint [rad]' in said and ':smile:' in said


def test_every_console_is_one_that_obeys_nothing():
    made = re.compile(r'(?<![\w.])Console\(|^from rich import print|rich\.print', re.MULTILINE)
    files = [p for p in (ROOT / 'src').rglob('*.py') if 'build' not in p.parts]
    mine = ROOT / 'src' / 'leo_msgs_py' / 'leo_msgs_py' / 'console.py'
    assert [str(p) for p in files if p != mine and made.search(p.read_text())] == []


def hostile_bag(folder: Path) -> Path:
    folder.mkdir()
    with (folder / 'bag_0.mcap').open('wb') as stream:
        writer = Writer(stream)
        writer.start('ros2')
        writer.add_metadata('leo', {'robot': HARM, HARM: HARM})
        text, _ = definition(JOINT_STATE)
        schema = writer.register_schema(JOINT_STATE, 'ros2msg', text.encode())
        names = '/joint_states', f'/{HARM}'
        channels = [writer.register_channel(name, 'cdr', schema) for name in names]
        for k in range(20):
            for channel in channels:
                writer.add_message(channel, k, joint_state(k * 10**7, [HARM], [0.1 * k], [1.0]), k)
        writer.finish()
    return folder


def harmless(text: str) -> bool:
    return not OBEYED.search(text)


@pytest.mark.parametrize(
    'words',
    [
        ['bag', 'info', 'bag'],
        ['compare', 'bag', '--model', 'pendulum'],
        ['check', 'bag', '--model', 'pendulum'],
        ['bag', 'show', 'bag'],
        ['import', f'{FILE}.csv', '--map', 'map.yaml', '-o', 'new'],
        ['import', 'log.csv', '--map', 'map.yaml', '-o', FILE],
        ['import', 'bad.csv', '--map', 'map.yaml', '-o', 'other'],
        ['compare', HARM, '--model', HARM],
        ['add', 'pendulum', f'{HARM}:pivot', 'b=1', '-o', 'm.yaml'],
        ['compare', 'bag', '--model', 'mine'],
        ['add', 'pendulum', '--from', 'e.json', '-o', 'n.yaml'],
    ],
)
def test_no_verb_prints_what_is_obeyed(words, tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    hostile_bag(tmp_path / 'bag')
    for name in (f'{FILE}.csv', 'log.csv'):
        (tmp_path / name).write_text('t,q\n0,0.1\n0.01,0.2\n0.02,0.3\n')
    (tmp_path / 'bad.csv').write_text(f't,q\n0,{HARM}\n')
    column_map = {'time': 't', 'joints': {HARM: {'position': 'q'}}, 'robot': HARM}
    (tmp_path / 'map.yaml').write_text(yaml.safe_dump(column_map))
    with pytest.raises(UserError):
        like(load_robot('pendulum'), tmp_path / 'mine', ('pivot', 'pi\x9b31mvot'))
    origin = {'provenance': {'robot': HARM, 'bags': [], 'date': HARM}}
    told = {'verdict': HARM, 'effects': [], 'constants': {}, 'not_testable': []}
    (tmp_path / 'e.json').write_text(json.dumps(told | origin))
    assert cli.main(words) in (0, 1, 2)
    out, err = capsys.readouterr()
    assert out + err and harmless(out) and harmless(err), (out, err)


def test_a_file_name_that_is_no_text_is_one_line(tmp_path):
    (tmp_path / 'map.yaml').write_text('time: t\njoints: {pivot: {position: q}}\n')
    for name, status in ((b'\xff.csv', 0), (b'\xfe.csv', 2)):
        if not status:
            Path(tmp_path, name.decode(errors='surrogateescape')).write_text('t,q\n0,1\n1,1\n')
        words = [sys.executable, '-c', CODE, 'import', name, '--map', 'map.yaml', '-o', name[:1]]
        done = subprocess.run(words, cwd=tmp_path, capture_output=True)
        assert done.returncode == status, done.stderr.decode()
        assert b'Traceback' not in done.stderr and b'\\udcf' in done.stdout + done.stderr


@pytest.mark.parametrize('name', [SHELL, 'two words', 'a\nb', "it's", '~', '*', '-o'])
def test_a_shell_takes_each_word_as_it_is(name, tmp_path):
    typed = SHOW + leo('bag', 'info', name)
    done = subprocess.run(['sh', '-c', typed], cwd=tmp_path, capture_output=True, text=True)
    assert done.stdout == f'bag\ninfo\n{name}\n'
    assert list(tmp_path.iterdir()) == []
