# SPDX-License-Identifier: Apache-2.0
"""`leo export`, as typed."""

import json
import sys
from xml.etree import ElementTree

import pytest
from tests.places import DATA
from tests.simulate import bag, record, TORQUE

from leo_diffmodel.verbs.export import main
from leo_msgs_py.errors import UserError
from leo_sim.effects import place
import leo_sim.references
from leo_sim.verbs.robot import main as robot_verb

MODEL = """\
robot: torque_pendulum
effects:
- {name: viscous_friction, where: all, parameters: {b: {value: 0.05, unit: N m s/rad}}}
- {name: voltage_deadband, where: all, parameters: {v: {value: 0.05, unit: N m}}}
"""


@pytest.fixture
def model(tmp_path):
    path = tmp_path / 'model.yaml'
    path.write_text(MODEL)
    return path


@pytest.mark.parametrize('ending', ['xml', 'urdf', 'sdf', 'py'])
def test_a_body_that_cannot_be_is_one_line_about_the_model(tmp_path, ending):
    urdf = ElementTree.parse(DATA / 'arm2.urdf')
    urdf.find('.//inertia').set('ixx', '1')
    urdf.write(tmp_path / 'arm.urdf')
    robot_verb(['init', str(tmp_path / 'arm.urdf'), '-o', str(tmp_path / 'arm')])
    with pytest.raises(UserError, match=r"/arm: link 'link1': no body .* correct them$"):
        main([str(tmp_path / 'arm'), '-o', str(tmp_path / f'out.{ending}')])
    assert not (tmp_path / f'out.{ending}').exists()


def test_what_is_left_out_is_printed_and_in_the_file(model, tmp_path, capsys):
    out = tmp_path / 'out.xml'
    assert main([str(model), '-o', str(out)]) == 0
    printed = capsys.readouterr().out
    assert 'holds viscous_friction at pivot: b = 0.05 N m s/rad' in printed
    line = next(x for x in printed.splitlines() if x.startswith('left out: voltage_deadband'))
    assert line.removeprefix('left out: ') in out.read_text()
    assert printed.splitlines()[-1] == f'next: python -m mujoco.viewer --mjcf={out}'
    assert ElementTree.parse(out).find('.//joint').get('damping') == '0.05'


def test_an_exported_urdf_is_a_robot_again(model, tmp_path, capsys):
    main([str(model), '-o', str(tmp_path / 'out.urdf')])
    assert robot_verb(['init', str(tmp_path / 'out.urdf'), '-o', str(tmp_path / 'arm')]) == 0


@pytest.mark.parametrize(
    ('words', 'said'),
    [
        (
            ['-o', 'out.mjcf'],
            r'out.mjcf: the format is said by a file that ends in \.xml \(mjcf\)',
        ),
        (['-o', 'out.xml', '--to', 'sdf'], r'out.xml: --to sdf is written to .* ends in \.sdf'),
        ([], r'which format\? give --to mjcf\|urdf\|sdf\|isaaclab'),
        (['--to', 'usd'], "invalid choice: 'usd'"),
        (['--to', 'sdf', '--check', 'nowhere'], 'no bag at nowhere'),
    ],
)
def test_what_is_typed_wrong_is_one_line_and_nothing_is_written(
    model, tmp_path, monkeypatch, words, said
):
    monkeypatch.chdir(tmp_path)
    with pytest.raises(UserError, match=said):
        main([str(model), *words])
    assert [path.name for path in tmp_path.iterdir()] == [model.name]


@pytest.mark.parametrize(
    ('to', 'files'),
    [
        ('mjcf', ['model.xml']),
        ('urdf', ['model.urdf']),
        ('sdf', ['model.sdf']),
        ('isaaclab', ['model.py', 'model.urdf']),
    ],
)
def test_the_format_alone_names_the_file(model, tmp_path, monkeypatch, capsys, to, files):
    monkeypatch.chdir(tmp_path)
    assert main([str(model), '--to', to]) == 0
    assert sorted({p.name for p in tmp_path.iterdir()} - {model.name}) == files
    printed, text = capsys.readouterr().out, (tmp_path / files[0]).read_text()
    for said in ('for ', 'left out: voltage_deadband'):
        line = next(x for x in printed.splitlines() if x.startswith(said))
        assert line.removeprefix('left out: ') in text


@pytest.fixture(scope='module')
def bag_of_it(tmp_path_factory):
    dead = place(TORQUE, 'voltage_deadband', 'all', v=0.05)
    viscous = place(TORQUE, 'viscous_friction', 'all', b=0.05)
    recording = record(TORQUE, viscous, dead, seconds=1.2)
    return str(bag(tmp_path_factory.mktemp('run') / 'bag', recording))


def test_a_check_prints_the_errors_side_by_side(model, bag_of_it, tmp_path, capsys):
    pytest.importorskip('mujoco')
    out = tmp_path / 'out.xml'
    assert main([str(model), '-o', str(out), '--check', bag_of_it]) == 0
    printed = ' '.join(capsys.readouterr().out.split())
    for said in ('what MJCF holds', 'noise floor', 'error of the file in MuJoCo: '):
        assert said in printed
    assert out.exists()


def test_json(model, bag_of_it, tmp_path, capsys):
    assert main([str(model), '-o', str(tmp_path / 'out.sdf'), '--check', bag_of_it, '--json']) == 0
    said = json.loads(capsys.readouterr().out)
    assert said['format'] == 'SDF' and said['written_for'].startswith('SDFormat 1.11')
    assert [line.split(' ')[0] for line in said['effects']] == ['viscous_friction']
    assert any('voltage_deadband' in line for line in said['left_out'])
    assert set(said['check']['errors']) == {'ours', 'reduced', 'noise_floor'}


def test_without_mujoco_nothing_is_written(model, bag_of_it, tmp_path, monkeypatch):
    monkeypatch.setitem(sys.modules, 'mujoco', None)
    monkeypatch.delitem(sys.modules, 'leo_sim.references.mujoco', raising=False)
    monkeypatch.delattr(leo_sim.references, 'mujoco', raising=False)
    with pytest.raises(UserError, match=r"--check of an MJCF needs .*: pip install 'mujoco>=3"):
        main([str(model), '-o', str(tmp_path / 'out.xml'), '--check', bag_of_it])
    assert not (tmp_path / 'out.xml').exists()


@pytest.mark.parametrize(('there', 'output'), [('out.xml', 'out.xml'), ('arm.urdf', 'arm.py')])
def test_no_file_is_written_over(model, tmp_path, there, output):
    (tmp_path / there).write_text('mine')
    with pytest.raises(UserError, match=rf'{there} exists'):
        main([str(model), '-o', str(tmp_path / output)])
    assert {path.name for path in tmp_path.iterdir()} == {model.name, there}


def test_where_a_model_is_stays_in_the_remark(model, tmp_path):
    folder = tmp_path / 'a---><mujoco>'
    folder.mkdir()
    moved = model.rename(folder / 'model.yaml')
    main([str(moved), '-o', str(tmp_path / 'out.urdf')])
    text = (tmp_path / 'out.urdf').read_text()
    assert ElementTree.fromstring(text).tag == 'robot'
    assert '--' not in text[text.index('<!--') + 4 : text.index('-->')]
