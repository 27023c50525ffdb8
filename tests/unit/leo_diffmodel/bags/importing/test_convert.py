# SPDX-License-Identifier: Apache-2.0
"""CSV, JSON and MATLAB logs become bags with the units, signs and episodes of a column map."""

import json
from pathlib import Path

from hypothesis import given
from hypothesis import strategies as st
import numpy as np
import pytest
import scipy.io
from tests.places import REAL_DATA
from tests.simulate import PENDULUM, TORQUE

from leo_diffmodel.bags import arrays
from leo_diffmodel.bags.importing.convert import import_logs, load_map
from leo_diffmodel.bags.importing.expression import evaluate
from leo_diffmodel.bags.recording import read_bag
from leo_diffmodel.verbs.import_logs import main
from leo_msgs_py.errors import UserError
from leo_sim.description.robot import load_robot

MAP = """
columns: {duty: 'where(load > 32767, load - 65536, load) / 885'}
time: {column: ms, unit: ms}
joints:
  pivot:
    position: {column: angle, unit: deg, sign: -1, offset: 0.25}
    velocity: {column: speed, unit: rpm}
inputs:
  pivot:
    voltage: {expression: duty * supply, unit: V}
    enabled: 'on'
"""
CSV = """ms,angle,speed,load,supply,on
0,0,0,0,7.0,true
10,90,60,885,7.4,true
25,180,-60,64651,7.4,false
"""


def write(folder: Path, name: str, text: str) -> Path:
    path = folder / name
    path.write_text(text)
    return path


def test_units_signs_offsets_and_computed_columns(tmp_path):
    column_map = write(tmp_path, 'map.yaml', MAP)
    bag = import_logs([write(tmp_path, 'log.csv', CSV)], column_map, tmp_path / 'bag')
    recording = read_bag(bag, PENDULUM)
    (episode,) = recording.episodes
    np.testing.assert_allclose(episode.t, [0.0, 0.01, 0.025])
    np.testing.assert_allclose(episode.q[:, 0], 0.25 - np.radians([0, 90, 180]))
    np.testing.assert_allclose(episode.dq[:, 0], [0, 2 * np.pi, -2 * np.pi])
    np.testing.assert_allclose(episode.inputs[:, 0], [0.0, 7.4, 0.0])
    assert episode.enabled[:, 0].tolist() == [True, True, False]
    assert recording.metadata['imported_from'] == 'log.csv'
    assert recording.metadata['angle_units_said'] == 'pivot'  # unit: deg


def test_a_robot_folder_counts_from_the_map(tmp_path):
    (tmp_path / 'maps/arm').mkdir(parents=True)
    column_map = load_map(write(tmp_path / 'maps', 'map.yaml', f'robot: arm\n{MAP}'))
    assert column_map.robot == f'{tmp_path}/maps/arm'


def test_an_angle_without_a_unit_is_taken_for_radians_and_noted_as_unsaid(tmp_path):
    column_map = write(tmp_path, 'map.yaml', MAP.replace(', unit: deg', '', 1))
    bag = import_logs([write(tmp_path, 'log.csv', CSV)], column_map, tmp_path / 'bag')
    assert read_bag(bag, PENDULUM).metadata['angle_units_said'] == ''


def test_each_log_is_an_episode_and_none_ends_in_the_next(tmp_path):
    column_map = write(tmp_path, 'map.yaml', MAP)
    logs = [write(tmp_path, f'{k}.csv', CSV) for k in range(3)]
    recording = read_bag(import_logs(logs, column_map, tmp_path / 'bag'), PENDULUM)
    assert [len(episode.t) for episode in recording.episodes] == [3, 3, 3]
    assert recording.warnings == ()


def test_json_records_with_missing_values(tmp_path):
    rows = [{'s': k / 100, 'angle': k, 'note': 'x'} for k in range(4)]
    rows[1]['angle'] = None
    log = write(tmp_path, 'log.json', json.dumps({'run': {'rows': rows}}))
    text = 'records: run.rows\ntime: s\njoints: {pivot: {position: angle}}\n'
    column_map = write(tmp_path, 'map.yaml', text)
    recording = read_bag(import_logs([log], column_map, tmp_path / 'bag'), PENDULUM)
    assert recording.episodes[0].q[:, 0].tolist() == [0.0, 2.0, 3.0]
    assert recording.input == 'none' and '1 samples with NaN' in ' '.join(recording.warnings)


def test_matlab_cells_are_episodes(tmp_path):
    cells = np.empty((2, 1), dtype=object)
    cells[0, 0], cells[1, 0] = np.array([[1.0, 2, 3], [4, 5, 6]]), np.array([[7.0, 8], [9, 10]])
    scipy.io.savemat(tmp_path / 'log.mat', {'Y': cells})
    text = "fields: {a: 'Y[*][0]', r: 'Y[*][1]'}\ntime: {period: 0.5}\n"
    text += 'joints: {pivot: {position: a, velocity: r}}\n'
    bag = import_logs([tmp_path / 'log.mat'], write(tmp_path, 'map.yaml', text), tmp_path / 'bag')
    first, second = read_bag(bag, PENDULUM).episodes
    assert first.q[:, 0].tolist() == [1.0, 2.0, 3.0] and first.dq[:, 0].tolist() == [4.0, 5.0, 6.0]
    assert second.q[:, 0].tolist() == [7.0, 8.0] and np.diff(second.t).tolist() == [0.5]


def test_blank_lines_are_none_and_lines_keep_their_numbers(tmp_path):
    column_map = write(tmp_path, 'map.yaml', SIMPLE)
    log = write(tmp_path, 'log.csv', '\n\nt,q\n\n0,0.1\n   \n0.1,0.2\n\n')
    bag = import_logs([log], column_map, tmp_path / 'bag')
    assert read_bag(bag, PENDULUM).episodes[0].q[:, 0].tolist() == [0.1, 0.2]
    wrong = write(tmp_path, 'wrong.csv', '\n\nt,q\n\n0,0.1\n\n0.1,x\n')
    with pytest.raises(UserError, match="line 7, q: 'x' is not a number"):
        import_logs([wrong], column_map, tmp_path / 'other')


SIMPLE = 'time: t\njoints: {pivot: {position: q}}\n'
ROWS = 't,q\n0,1\n1,1\n'
POSITION = 'time: t\njoints: {pivot: {position: {column: q, unit: %s}}}\n'


@pytest.mark.parametrize(
    ('log', 'column_map', 'message'),
    [
        ('t,q\n0,1\n0.2,1\n0.1,1\n', SIMPLE, 'backwards at sample 3, from 0.2 s to 0.1 s; sort'),
        ('t,x\n0,1\n1,1\n', SIMPLE, "has no column 'q' for position; it has t, x"),
        ('t,q\n0,1\n1,one\n', SIMPLE, "line 3, q: 'one' is not a number"),
        ('t,q\n', SIMPLE, 'log.csv has a head but no rows'),
        ('t,q\n0,1\n1e90,1\n', SIMPLE, 'time runs from 0 to 1e+90 s; which unit is it in?'),
        (ROWS, SIMPLE + "delimiter: ';;'\n", 'delimiter: String should have at most 1'),
        (ROWS, SIMPLE + 'columns: {x: where(q)}\n', 'where takes 3 arguments, found 1'),
        (ROWS, SIMPLE + f'columns: {{x: {"+".join("q" * 20_000)}}}\n', 'is too long; build it up'),
        ('', SIMPLE, 'is empty'),
        ('t,q\n0,1\n', SIMPLE, '1 samples with a time; at least 2 are needed'),
        ('t,q\n5,1\n5,1\n', SIMPLE, 'log.csv: the time column t does not change; name the one'),
        ('t,q\n0,inf\n1,nan\n2,1\n', SIMPLE, 'log.csv: 1 rows have a number for q; at least 2'),
        (
            't,q,u\n0,1,nan\n1,1,inf\n',
            SIMPLE + 'inputs: {pivot: {voltage: u}}\n',
            'log.csv: u (voltage of pivot) holds no number; name another column',
        ),
        (ROWS, POSITION % 'V', "'V' is no unit of position; give it in rad or m"),
        (ROWS, POSITION % 'dg', "position: unit 'dg': 'dg' is not known; did you mean deg?"),
        (ROWS, SIMPLE.replace('position', 'positon'), "'joints.pivot.positon'; did you mean posi"),
        (ROWS, SIMPLE + 'inputs: {pivt: {voltage: q}}\n', "name 'pivt'; did you mean pivot"),
        (ROWS, SIMPLE + 'inputs: {pivot: {enabled: q}}\n', "input of 'pivot' needs voltage, ef"),
        (ROWS, SIMPLE + 'columns: {x: q * tt}\n', "column x: expression 'q * tt': no column 'tt'"),
        (ROWS, SIMPLE.replace('time: t', 'time: {}'), 'give either column or period'),
    ],
)
def test_what_is_wrong_is_said_in_one_line_and_no_bag_is_made(tmp_path, log, column_map, message):
    said, file = write(tmp_path, 'map.yaml', column_map), write(tmp_path, 'log.csv', log)
    with pytest.raises(UserError) as refusal:
        import_logs([file], said, tmp_path / 'bag')
    assert message in str(refusal.value) and '\n' not in str(refusal.value)
    assert not (tmp_path / 'bag').exists()


def test_an_unknown_map_names_the_nearest():
    with pytest.raises(UserError, match='did you mean bam_xl330'):
        load_map('bam_xl33')


@given(st.floats(-1e3, 1e3), st.floats(-1e3, 1e3))
def test_expressions_are_arithmetic(a, b):
    columns = {'a': np.array([a]), 'b': np.array([b])}
    expected = -abs(a) * b + min(a, 2.0) ** 2 - (b if a > b else 1.0)
    value = evaluate('-abs(a) * b + min(a, 2)**2 - where(a > b, b, 1)', columns)
    np.testing.assert_allclose(value, [expected])


def test_expressions_leave_columns_as_they_are_and_divide_by_zero():
    q = np.array([-1.0, 2.0, 0.0])
    with pytest.raises(UserError, match='abs takes 1 arguments, found 2'):
        evaluate('abs(q, q)', {'q': q})
    assert q.tolist() == [-1.0, 2.0, 0.0]
    assert np.isnan(evaluate('0/0*q', {'q': q})).all()
    np.testing.assert_array_equal(evaluate('1 / q', {'q': q}), [-1.0, 0.5, np.inf])


@pytest.mark.parametrize(
    'text',
    [
        *('__import__("os")', 'a.real', 'a[0]', '(lambda: 1)()', '[x for x in a]', '"text"', ''),
        *('a if b', 'abs(a, out=b)', 'exec("1")', 'a and b', '1 < a < 2', 'min(a)'),
    ],
)
def test_anything_but_arithmetic_is_refused(text):
    with pytest.raises(UserError, match='expression'):
        evaluate(text, {'a': np.ones(3), 'b': np.ones(3)})


def test_the_verb_writes_one_bag_or_one_each(tmp_path, capsys):
    logs = [str(write(tmp_path, f'{k}.csv', CSV)) for k in range(2)]
    column_map = str(write(tmp_path, 'map.yaml', MAP))
    assert main([*logs, '--map', column_map, '-o', str(tmp_path / 'one'), '--json']) == 0
    found = json.loads(capsys.readouterr().out)
    assert [(bag['episodes'], bag['samples']) for bag in found['bags']] == [(2, 6)]
    assert main([*logs, '--map', column_map, '-o', str(tmp_path / 'each'), '--bag-per-log']) == 0
    assert sorted(path.name for path in (tmp_path / 'each').iterdir()) == ['0', '1']
    assert f'next: leo compare {tmp_path}/each/0' in capsys.readouterr().out
    with pytest.raises(UserError, match='exists already'):
        main([*logs, '--map', column_map, '-o', str(tmp_path / 'one')])


def test_logs_of_one_name_become_bags_with_the_names_of_their_folders(tmp_path):
    column_map, logs = str(write(tmp_path, 'map.yaml', MAP)), []
    for name in ('pd', 'ddp'):
        (tmp_path / name).mkdir()
        logs.append(str(write(tmp_path / name, 'measured.csv', CSV)))
    into = ['--map', column_map, '-o', str(tmp_path / 'bags'), '--bag-per-log']
    assert main([*logs, *into]) == 0
    names = sorted(path.name for path in (tmp_path / 'bags').iterdir())
    assert names == ['ddp.measured', 'pd.measured']
    with pytest.raises(UserError, match='two logs would become one bag'):
        main([logs[0], logs[0], *into])


@pytest.mark.skipif(not REAL_DATA.is_dir(), reason=f'no measurements in {REAL_DATA}')
class TestRealMeasurements:
    def test_dfki_simple_pendulum(self, tmp_path):
        logs = sorted((REAL_DATA / 'dfki_simple_pendulum').glob('*.data_measured.csv'))
        recording = read_bag(import_logs(logs, 'dfki_simple_pendulum', tmp_path / 'bag'), TORQUE)
        assert [len(episode.t) for episode in recording.episodes] == [3000, 1170, 4000, 1170]
        assert recording.input == 'torque' and recording.warnings == ()
        for log, episode in zip(logs, recording.episodes, strict=True):
            expected = np.loadtxt(log, delimiter=',', skiprows=1)
            np.testing.assert_allclose(episode.t - episode.t[0], expected[:, 0], atol=1e-9)
            np.testing.assert_array_equal(episode.q[:, 0], expected[:, 1])
            np.testing.assert_array_equal(episode.dq[:, 0], expected[:, 2])
            np.testing.assert_array_equal(episode.inputs[:, 0], expected[:, 3])

    def test_bam_xl330(self, tmp_path):
        logs = sorted((REAL_DATA / 'bam_xl330').glob('*.json'))
        bag = import_logs(logs, 'bam_xl330', tmp_path / 'bag')
        recording = read_bag(bag, load_robot('servo_pendulum'))
        assert len(recording.episodes) == len(logs) == 12 and recording.warnings == ()
        for log, episode in zip(logs, recording.episodes, strict=True):
            entries = json.loads(log.read_text())['entries']
            held = [entry['torque_enable'] for entry in entries]
            assert episode.enabled[:, 0].tolist() == held
            error = np.array([e['goal_position'] - e['position'] for e in entries])
            pushes = (np.abs(episode.inputs[:, 0]) > 1.0) & held
            agree = np.sign(episode.inputs[pushes, 0]) == np.sign(error[pushes])
            assert np.mean(agree) > 0.95 and np.abs(episode.inputs).max() < 9.5

    def test_dfki_double_pendulum(self, tmp_path):
        logs = sorted((REAL_DATA / 'dfki_double_pendulum').glob('*_measured.csv'))
        bag = import_logs(logs, 'dfki_double_pendulum', tmp_path / 'bag')
        recording = read_bag(bag, load_robot('double_pendulum'))
        assert len(recording.episodes) == len(logs) == 7 and recording.warnings == ()
        expected = np.loadtxt(logs[0], delimiter=',', skiprows=1)
        np.testing.assert_array_equal(recording.episodes[0].q, expected[:, 1:3])
        np.testing.assert_array_equal(recording.episodes[0].inputs, expected[:, 5:7])

    def test_map_single_pendulum(self, tmp_path):
        log = next((REAL_DATA / 'map_single_pendulum').glob('SinglePendulumData*.mat'))
        recording = read_bag(import_logs([log], 'map_single_pendulum', tmp_path / 'bag'), PENDULUM)
        assert [len(episode.t) for episode in recording.episodes] == [9167] * 4
        assert recording.input == 'none'
        assert abs(np.concatenate([e.q for e in recording.episodes]).mean()) < 0.05
        held_out = import_logs([log], 'map_single_pendulum_validation', tmp_path / 'held_out')
        assert [len(e.t) for e in read_bag(held_out, PENDULUM).episodes] == [9167, 9166]


def test_an_interrupted_import_leaves_no_half_bag(tmp_path, monkeypatch):
    (tmp_path / 'log.csv').write_text('t,angle\n0,1\n1,2\n')
    (tmp_path / 'map.yaml').write_text('time: t\njoints: {pivot: {position: angle}}\n')

    def interrupted(*fields):
        raise KeyboardInterrupt

    monkeypatch.setattr(arrays.cdr, 'joint_state', interrupted)
    with pytest.raises(KeyboardInterrupt):
        import_logs([tmp_path / 'log.csv'], tmp_path / 'map.yaml', tmp_path / 'bag')
    assert not (tmp_path / 'bag').exists()
