# SPDX-License-Identifier: Apache-2.0
"""The `leo` dispatcher: verbs, mistakes, exit status."""

import errno
from importlib.metadata import entry_points
import os
import re
import signal
import subprocess
import sys
import tomllib
from unittest.mock import Mock
from xml.etree import ElementTree

import pytest
from tests.commands import CODE
from tests.places import ROOT
import yaml

from leo_msgs_py import cli
from leo_msgs_py.errors import UserError
from leo_msgs_py.verbs import run
from leo_msgs_py.verbs.common import Parser

LONG = 'x' * 300
VERBS = ('node', 'param', 'run', 'service', 'status', 'topic')


FAILING = {
    'refuse': UserError('the bag x\n  is empty; record one'),
    'full': OSError(errno.ENOSPC, os.strerror(errno.ENOSPC), 'out/report.html'),
    'interrupt': KeyboardInterrupt(),
    'import': ImportError('initialization failed'),
    'ros': ModuleNotFoundError("No module named 'rclpy'", name='rclpy.node'),
    'tea': ModuleNotFoundError("No module named 'tea'", name='tea'),
}
FAILING['import'].__cause__ = KeyboardInterrupt()


class Entry:
    module = 'not_installed'

    def __init__(self, name, function):
        self.name, self.load = name, lambda: function


@pytest.fixture
def verbs(monkeypatch):
    entries = [
        Entry('fine', len),
        Entry('guard', lambda argv: int('_ROS_WHEELS_BOOTSTRAP_COMPLETE' in os.environ)),
        *(Entry(name, Mock(side_effect=error)) for name, error in FAILING.items()),
    ]
    monkeypatch.setattr(cli, 'entry_points', lambda group: entries)


def test_a_full_disk_is_one_line(verbs, capfd):
    assert cli.main(['full']) == 2
    (line,) = capfd.readouterr().err.splitlines()
    assert line == 'leo: error: No space left on device: out/report.html; make room'
    with open('/dev/full', 'w') as full:
        words = [sys.executable, '-c', CODE, '--help']
        done = subprocess.run(words, stdout=full, stderr=subprocess.PIPE, text=True)
    assert done.returncode == 2 and len(done.stderr.splitlines()) == 1


@pytest.mark.parametrize(
    'words',
    [
        ['compare', LONG, '--model', 'pendulum'],
        ['bag', 'info', LONG],
        ['play', LONG],
        ['learn', '--resume', LONG],
        ['import', LONG, '--map', 'bam_xl330', '-o', 'bag'],
        ['run', 'leo_sim', 'robot', '--ros-args', '-p', f'robot:={LONG}'],
    ],
)
def test_a_name_that_is_too_long_is_one_line(words, domain, capfd):
    assert cli.main(words) == 2
    lines = [line for line in capfd.readouterr().err.splitlines() if '[INFO]' not in line]
    assert len(lines) == 1 and lines[0].startswith('leo: error: ')


def test_help_of_an_executable_starts_none(monkeypatch, capsys):
    monkeypatch.setattr('importlib.metadata.EntryPoint.load', lambda _: pytest.fail('started'))
    with pytest.raises(SystemExit, match=r'^0$'):
        run.main(['leo_sim', 'robot', '--help'])
    assert 'usage: leo run' in capsys.readouterr().out


def test_a_verb_gets_the_rest_and_gives_the_status(verbs):
    assert cli.main(['fine', 'a', 'b']) == 2
    assert cli.main(['fine']) == 0


@pytest.mark.parametrize('verb', ['refuse', 'interrupt', 'import'])
def test_bad_input_is_one_line_and_an_interrupt_none(verb, verbs, capsys):
    said = (2, 'leo: error: the bag x is empty; record one\n') if verb == 'refuse' else (130, '')
    assert (cli.main([verb]), capsys.readouterr().err) == said


def test_where_ros_is_missing_one_line_says_how_to_get_it(verbs, capsys):
    assert cli.main(['ros']) == 2
    error = capsys.readouterr().err
    assert error.count('\n') == 1
    assert all(part in error for part in ('ROS 2', 'ros-jazzy-rclpy', './run_all.sh setup'))
    with pytest.raises(ModuleNotFoundError, match='tea'):
        cli.main(['tea'])


def test_children_find_the_libraries_of_their_own_python(verbs, monkeypatch):
    monkeypatch.setenv('_ROS_WHEELS_BOOTSTRAP_COMPLETE', '1')
    assert cli.main(['guard']) == 0


def test_an_unknown_verb_names_the_nearest(verbs, capsys):
    assert cli.main(['refus']) == 2
    assert "did you mean 'refuse'?" in capsys.readouterr().err


@pytest.mark.parametrize('verb', ['blind', 'reproduce', 'seeds'])
def test_a_verb_of_the_laboratory_says_how_to_install_that(verb, verbs, capsys):
    assert cli.main([verb, '--help']) == 2
    (line,) = capsys.readouterr().err.splitlines()
    assert line == (
        f"leo: error: unknown verb '{verb}'; it is one of the laboratory, which is "
        "not installed: pip install ./benchmarks/laboratory, in this project's source"
    )
    assert (ROOT / 'benchmarks/laboratory/pyproject.toml').is_file()


def test_the_first_page_has_a_line_for_each_of_eight_verbs_and_names_the_others_once(capsys):
    assert cli.main(['--help']) == 0
    text = capsys.readouterr().out
    first, others = (part.partition('\n\n')[0] for part in text.split(':\n  ')[1:3])
    lines = [line.split(maxsplit=1) for line in first.splitlines()]
    named = re.split(r',? +|\n', others)
    verbs = {entry.name for entry in entry_points(group='leo.verbs')}
    assert len(lines) == 8 and all(len(line) == 2 for line in lines)
    assert {line[0] for line in lines}.isdisjoint(named)
    assert verbs <= {line[0] for line in lines} | set(named)
    assert all(len(line) <= 100 for line in text.splitlines())
    assert cli.main([]) == 2 and capsys.readouterr().out == text


def test_a_verb_of_another_package_is_named_too(verbs, capsys):
    assert cli.main(['help']) == 0
    assert re.search(r'from other packages +fine, full, guard', capsys.readouterr().out)


@pytest.mark.parametrize('verb', VERBS)
def test_every_verb_has_help_with_examples(verb, capsys):
    with pytest.raises(SystemExit) as end:
        cli.main([verb, '--help'])
    assert end.value.code == 0
    shown = capsys.readouterr().out
    assert f'  leo {verb} ' in shown.partition('examples:')[2]
    with pytest.raises(SystemExit):
        cli.main(['help', verb])
    assert capsys.readouterr().out == shown


@pytest.mark.parametrize(
    'argv', [['run'], ['run', 'no', 'such'], ['topic'], ['topic', 'ech'], ['topic', 'echo', '-x']]
)
def test_a_wrong_command_line_is_one_line(argv, capsys):
    assert cli.main(argv) == 2
    error = capsys.readouterr().err
    assert error.startswith('leo: error: ')
    assert error.count('\n') == 1


def test_nan_is_no_number():
    """To wait so long, or to send so often, had no end."""
    parser = Parser('leo x', '', '')
    parser.add_argument('--seconds', type=float)
    assert parser.parse_args(['--seconds', 'inf']).seconds == float('inf')
    with pytest.raises(UserError, match="leo x: argument --seconds: invalid float value: 'nan'"):
        parser.parse_args(['--seconds', 'nan'])


SLEEPER = """
import time
from leo_msgs_py.cli import executable

@executable
def main(argv):
    try:
        print('ready', flush=True)
        time.sleep(60)
    finally:
        print('tidied', flush=True)

raise SystemExit(main([]))
"""


@pytest.mark.parametrize('number', [signal.SIGTERM, signal.SIGINT])
def test_sigterm_interrupts_as_ctrl_c_does(number):
    process = subprocess.Popen([sys.executable, '-c', SLEEPER], stdout=subprocess.PIPE, text=True)
    assert process.stdout.readline() == 'ready\n'
    process.send_signal(number)
    assert process.communicate()[0] == 'tidied\n'
    assert process.returncode == 128 + number


def test_one_version_everywhere(capsys):
    assert cli.main(['--version']) == 0
    version = capsys.readouterr().out.removeprefix('leo ').strip()
    manifests = sorted(ROOT.glob('src/*/package.xml'))
    assert [ElementTree.parse(m).findtext('version') for m in manifests] == [version] * 4
    laboratory = tomllib.loads((ROOT / 'benchmarks/laboratory/pyproject.toml').read_text())
    assert laboratory['project']['version'] == version
    assert yaml.safe_load((ROOT / 'CITATION.cff').read_text())['version'] == version
    assert f'\n## {version} ' in (ROOT / 'CHANGELOG.md').read_text()


def test_each_verb_has_one_line(capsys):
    assert cli.main(['help', 'all']) == 0
    lines = capsys.readouterr().out.splitlines()
    verbs = {entry.name for entry in entry_points(group='leo.verbs')}
    assert [line.split()[0] for line in lines] == sorted(verbs)
    assert all(len(line.split(maxsplit=1)) == 2 and len(line) <= 100 for line in lines)


def test_a_python_that_a_command_starts_takes_no_module_from_the_folder_of_now(tmp_path):
    """As a process pool does: somebody's robot folder may hold a joblib.py."""
    (tmp_path / 'joblib.py').write_text('print("ran")')

    def started(_: list[str]) -> int:
        words = [sys.executable, '-c', 'import joblib']
        return len(subprocess.run(words, cwd=tmp_path, capture_output=True, check=True).stdout)

    before = dict(os.environ)
    assert cli.executable(started)([]) == 0
    assert dict(os.environ) == before
