# SPDX-License-Identifier: Apache-2.0
"""`--ros-args`: parameters, parameter files, remaps, log level."""

import pytest

from leo_msgs_py.errors import UserError
from leo_msgs_py.node.args import parse

FILE = """
/**:
  ros__parameters: {rate: 1.0, motor: {gain: 2, name: left}}
robot:
  ros__parameters: {rate: 5}
/left/robot: {ros__parameters: {rate: 7}}
pair:
  '*': {ros__parameters: {rate: 9}}
"""


def test_parameters_are_typed_by_yaml():
    words = ['--ros-args', '-p', 'a:=1', '-p', 'b:=1.5', '-p', 'c:=[x, y]', '--param', 'd:=true']
    found = parse(words, 'robot').overrides('/robot')
    assert found == {'a': 1, 'b': 1.5, 'c': ['x', 'y'], 'd': True}
    assert type(found['a']) is int


@pytest.mark.parametrize('text, value', [
    ('1e-3', 0.001), ('+1.5E3', 1500.0), ('[1e-3, .5]', [0.001, 0.5]), ('.inf', float('inf')),
    ('0x10', 16), ('-3', -3), ('2026-01-31', '2026-01-31'), ('1_000', '1_000'),
    ('12:30', '12:30'), ('runs/1', 'runs/1'), ('08', '08'), ('on', True),
])  # fmt: skip
def test_numbers_are_those_of_ros(text, value):
    found = parse(['--ros-args', '-p', f'a:={text}'], 'robot').overrides('/robot')['a']
    assert (found, type(found)) == (value, type(value))


def test_later_ones_win_and_nodes_can_be_named():
    words = ['--ros-args', '-p', 'a:=1', '-p', 'a:=2', '-p', 'robot:b:=3', '-p', 'other:b:=4']
    assert parse(words, 'robot').overrides('/ns/robot') == {'a': 2, 'b': 3}


@pytest.mark.parametrize(
    'node, rate', [('/x', 1.0), ('/robot', 5), ('/left/robot', 7), ('/pair/any', 9)]
)
def test_parameter_files_know_wildcards(tmp_path, node, rate):
    path = tmp_path / 'p.yaml'
    path.write_text(FILE)
    found = parse(['--ros-args', '--params-file', str(path)], 'robot').overrides(node)
    assert found == {'rate': rate, 'motor.gain': 2, 'motor.name': 'left'}


def test_remaps_names_and_the_rest():
    words = 'a --ros-args -r x:=y -r __ns:=/n -r __node:=m -r other:z:=w --log-level debug -- b'
    args = parse(words.split(), 'robot')
    assert (args.node, args.namespace, args.remaps) == ('m', '/n', [('x', 'y')])
    assert (args.log_level, args.rest) == ('debug', ['a', 'b'])


def test_what_launch_adds_is_accepted():
    words = '--ros-args --disable-stdout-logs -e /e --log-config-file f -p a:=1'
    assert parse(words.split(), 'robot').overrides('/robot') == {'a': 1}


@pytest.mark.parametrize(
    'words, says',
    [
        (['-p', 'a=1'], 'name:=value'),
        (['-p'], 'needs a value'),
        (['-q', 'x'], "unknown '-q'"),
        (['-p', 'a:=[1'], 'not YAML'),
        (['--log-level', 'loud'], 'debug, info'),
        (['--params-file', '/nowhere.yaml'], '/nowhere.yaml cannot be read'),
    ],
)
def test_mistakes_are_named(words, says):
    with pytest.raises(UserError, match=says):
        parse(['--ros-args', *words], 'robot')


def test_a_file_without_parameters_is_refused(tmp_path):
    path = tmp_path / 'p.yaml'
    path.write_text('robot: {rate: 1}')
    with pytest.raises(UserError, match='ros__parameters'):
        parse(['--ros-args', '--params-file', str(path)], 'robot')
