# SPDX-License-Identifier: Apache-2.0
"""`leo export`, as typed."""

import json
from xml.etree import ElementTree

import pytest

from leo_msgs_py.errors import UserError
from leo_sim.verbs.export import main
from leo_sim.verbs.robot import main as robot_verb

MODEL = """\
robot: torque_pendulum
effects:
- {name: viscous_friction, where: all, parameters: {b: {value: 0.05, unit: N m s/rad}}}
- {name: quadratic_drag, where: all, parameters: {d: {value: 0.01, unit: N m s2/rad2}}}
"""


@pytest.fixture
def model(tmp_path):
    path = tmp_path / 'model.yaml'
    path.write_text(MODEL)
    return path


def test_what_is_left_out_is_printed_and_in_the_file(model, tmp_path, capsys):
    out = tmp_path / 'out.xml'
    assert main([str(model), '-o', str(out)]) == 0
    printed = capsys.readouterr().out
    assert 'holds viscous_friction at pivot: b = 0.05 N m s/rad' in printed
    line = next(x for x in printed.splitlines() if x.startswith('left out: quadratic_drag'))
    assert line.removeprefix('left out: ') in out.read_text()
    assert printed.splitlines()[-1] == f'next: python -m mujoco.viewer --mjcf={out}'
    assert ElementTree.parse(out).find('.//joint').get('damping') == '0.05'


def test_json(model, tmp_path, capsys):
    assert main([str(model), '-o', str(tmp_path / 'out.urdf'), '--json']) == 0
    said = json.loads(capsys.readouterr().out)
    assert said['format'] == 'URDF'
    assert [line.split(' ')[0] for line in said['effects']] == ['viscous_friction']
    assert any('quadratic_drag' in line for line in said['left_out'])


def test_an_exported_urdf_is_a_robot_again(model, tmp_path, capsys):
    main([str(model), '-o', str(tmp_path / 'out.urdf')])
    assert robot_verb(['init', str(tmp_path / 'out.urdf'), '-o', str(tmp_path / 'arm')]) == 0


def test_a_name_must_say_the_format(model, tmp_path):
    with pytest.raises(UserError, match='says which format'):
        main([str(model), '-o', str(tmp_path / 'out.mjcf')])


def test_no_file_is_written_over(model, tmp_path):
    (tmp_path / 'out.xml').write_text('mine')
    with pytest.raises(UserError, match='exists'):
        main([str(model), '-o', str(tmp_path / 'out.xml')])


def test_where_a_model_is_stays_in_the_remark(model, tmp_path):
    folder = tmp_path / 'a---><mujoco>'
    folder.mkdir()
    moved = model.rename(folder / 'model.yaml')
    main([str(moved), '-o', str(tmp_path / 'out.urdf')])
    text = (tmp_path / 'out.urdf').read_text()
    assert ElementTree.fromstring(text).tag == 'robot'
    assert '--' not in text[text.index('<!--') + 4 : text.index('-->')]
