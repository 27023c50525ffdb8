# SPDX-License-Identifier: Apache-2.0
"""Matrices and rows that are lists, by number or by the names of the map; what is no log."""

import json

import numpy as np
import pytest
import scipy.io

from leo_diffmodel.bags.importing.column_map import ColumnMap
from leo_diffmodel.bags.importing.convert import import_logs
from leo_diffmodel.bags.importing.guess import guess_map
from leo_diffmodel.bags.importing.log_format import LogFormat
from leo_diffmodel.bags.importing.tables import read_tables
from leo_diffmodel.bags.recording import read_bag
from leo_msgs_py.errors import UserError
from leo_sim.description.robot import load_robot

T = np.arange(5) / 100
ROWS = np.column_stack([T, 6 * T, 0.1 + T, 0.2 - T])
FRC = {
    'sysid': True,
    'test': 'Arm',
    'units': 'Radians',
    'slow-forward': ROWS.tolist(),
    'slow-backward': (-ROWS[:4] + [[2 * t, 0, 0, 0] for t in T[:4]]).tolist(),
}


def imported(tmp_path, log, mapping, robot='pendulum'):
    bag = import_logs([log], ColumnMap.model_validate(mapping), tmp_path / 'bag')
    return read_bag(bag, load_robot(robot)).episodes


@pytest.mark.parametrize(('matrix', 'column'), [(ROWS, 'data[:, {}]'), (ROWS.T, 'data[{},:]')])
def test_one_matrix_of_a_matlab_file(tmp_path, matrix, column):
    scipy.io.savemat(tmp_path / 'log.mat', {'data': matrix, 'mass': 0.5, 'note': 'a text'})
    time, volts, angle, speed = map(column.format, range(4))
    said = {
        'time': time,
        'joints': {'pivot': {'position': angle, 'velocity': speed}},
        'inputs': {'pivot': {'voltage': {'expression': f'0.5 * {volts}'}}},
    }
    (episode,) = imported(tmp_path, tmp_path / 'log.mat', said)
    np.testing.assert_allclose(episode.q[:, 0], ROWS[:, 2])
    np.testing.assert_allclose(episode.dq[:, 0], ROWS[:, 3])
    np.testing.assert_allclose(episode.inputs[:, 0], 0.5 * ROWS[:, 1])


def test_numbers_beside_a_matrix_and_structs_are_columns(tmp_path):
    scipy.io.savemat(tmp_path / 'log.mat', {'run': {'t': T, 'q': ROWS[:, 2]}, 'mass': 0.5})
    (table,) = read_tables(tmp_path / 'log.mat', LogFormat())
    assert {*table} == {'run.t', 'run.q', 'mass'} and table['mass'].tolist() == [0.5] * 5


def test_a_column_that_a_matrix_has_not(tmp_path):
    scipy.io.savemat(tmp_path / 'log.mat', {'data': ROWS})
    mapping = {'time': 'data[:, 0]', 'joints': {'pivot': {'position': 'data[:, 9]'}}}
    with pytest.raises(UserError, match=r"no column 'data\[9\]' for position; it has data\[0\],"):
        imported(tmp_path, tmp_path / 'log.mat', mapping)


@pytest.mark.parametrize(
    'names',
    [
        {'time': 0, 'joints': {'pivot': {'position': 2, 'velocity': {'column': 3}}}},
        {
            'header': ['t', 'u', 'q', 'dq'],
            'time': 't',
            'joints': {'pivot': {'position': 'q', 'velocity': 'dq'}},
        },
    ],
)
def test_json_rows_that_are_lists_of_several_runs(tmp_path, names):
    (tmp_path / 'frc.json').write_text(json.dumps(FRC))
    runs = names | {'records': ['slow-forward', 'slow-backward']}
    first, second = imported(tmp_path, tmp_path / 'frc.json', runs)
    np.testing.assert_allclose(first.q[:, 0], ROWS[:, 2])
    np.testing.assert_allclose(second.q[:, 0], -ROWS[:4, 2])


@pytest.mark.parametrize(
    ('content', 'message'),
    [
        ('{"t": [0, 1], "q": [1, 2], "q": [3, 4]}', "'q' stands twice in one object"),
        ('[[0, 1], [1]]', "row 2 at 'the top' has 1 values, not 2"),
        ('[[0, 1], {"t": 1}]', "no list of records at 'the top'"),
    ],
)
def test_json_that_is_not_clear(tmp_path, content, message):
    (tmp_path / 'log.json').write_text(content)
    with pytest.raises(UserError, match=message):
        read_tables(tmp_path / 'log.json', LogFormat())


def test_texts_beside_arrays_are_left_out(tmp_path):
    content = {'robot': 'arm', 'joints': ['a', 'b'], 'kp': 3, 't': [0, 1], 'q': [1, 2]}
    (tmp_path / 'log.json').write_text(json.dumps(content))
    (table,) = read_tables(tmp_path / 'log.json', LogFormat())
    found = {name: values.tolist() for name, values in table.items()}
    assert found == {'kp': [3, 3], 't': [0, 1], 'q': [1, 2]}


def test_arrays_of_other_lengths_are_told_and_refused_where_the_map_names_them(tmp_path):
    log = tmp_path / 'log.npz'
    np.savez(log, t=T, q=T, goal=T[1:])
    text = guess_map(log, tmp_path / 'map.yaml').read_text()
    assert "# 'goal': 4 values and not 5, so left out; cut them to one length, or save" in text
    mapping = {'time': {'period': 0.01}, 'joints': {'pivot': {'position': 'goal'}}}
    (episode,) = imported(tmp_path, log, mapping)
    assert episode.q[:, 0].tolist() == T[1:].tolist()
    mapping['inputs'] = {'pivot': {'effort': {'expression': '2 * q'}}}
    with pytest.raises(UserError, match=r'log.npz: q has 5 values and goal 4; cut them to one le'):
        imported(tmp_path, log, mapping)


FORMAT = """
import numpy as np

from leo_diffmodel.bags.importing.log_format import Reader


def read(log, log_format):
    return [{'t': np.array([float(line) for line in log.read_text().split()])}]


TICKS = Reader('ticks', ('tick',), read)
"""


def test_a_format_of_another_package_is_an_entry_point(tmp_path, monkeypatch):
    facts = tmp_path / 'clocks-1.dist-info'
    facts.mkdir()
    (facts / 'METADATA').write_text('Metadata-Version: 2.1\nName: clocks\nVersion: 1\n')
    (facts / 'entry_points.txt').write_text('[leo.log_formats]\nticks = clocks:TICKS\n')
    (tmp_path / 'clocks.py').write_text(FORMAT)
    monkeypatch.syspath_prepend(tmp_path)
    for name, said in (('a.tick', LogFormat()), ('a.dat', LogFormat(format='ticks'))):
        (tmp_path / name).write_text('0 1')
        (table,) = read_tables(tmp_path / name, said)
        assert table['t'].tolist() == [0, 1]
    (tmp_path / 'b.tick').write_text('0 x')
    with pytest.raises(UserError, match=r'clocks.py line 8: ValueError: .*; mend the log format'):
        read_tables(tmp_path / 'b.tick', LogFormat())
    with pytest.raises(UserError, match=r"unknown format 'dat'.*csv, json, .*bag or ticks"):
        read_tables(tmp_path / 'a.dat', LogFormat())


def test_an_unknown_format_names_those_that_are_known(tmp_path):
    (tmp_path / 'a.csv').write_text('t\n0\n')
    for said in ('xls', 'lerobot'):
        with pytest.raises(UserError) as refusal:
            read_tables(tmp_path / 'a.csv', LogFormat(format=said))
        told = f"unknown format '{said}'; name one (format: csv, json, jsonl, mat, "
        assert str(refusal.value).startswith(f'{tmp_path}/a.csv: {told}')


@pytest.mark.parametrize(
    ('file', 'log', 'message'),
    [
        ('run.xlsx', 'run.xlsx', 'is a spreadsheet; save it as CSV and import that'),
        ('run.pkl', 'run.pkl', 'is a pickle, which can run code as it is read; save np.savez('),
        ('run.db3.gz', 'run.db3.gz', 'a bag already and needs no import; unpack it with gunzip'),
        ('run.mcap', 'run.mcap', 'is a bag already and needs no import; look into it: leo bag'),
        ('run/run_0.mcap', 'run', 'is a bag already and needs no import; look into it: leo bag'),
        ('run/run_0.db3', 'run', 'is a bag already and needs no import; look into it: leo bag'),
        ('run/a.csv', 'run', 'is a folder without meta/info.json'),
        ('run/a.csv', 'other', 'no log'),
        ('run.dat', 'run.dat', "unknown format 'dat'"),
    ],
)
def test_what_is_no_log_is_told_what_to_do(tmp_path, file, log, message):
    (tmp_path / file).parent.mkdir(exist_ok=True)
    (tmp_path / file).touch()
    with pytest.raises(UserError) as refusal:
        read_tables(tmp_path / log, LogFormat())
    assert message in str(refusal.value) and '\n' not in str(refusal.value)
