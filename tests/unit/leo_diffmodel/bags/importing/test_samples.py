# SPDX-License-Identifier: Apache-2.0
"""Rows of a log that are no samples are left out, and a line of the import says so."""

import json
from pathlib import Path
import warnings

import numpy as np
import pytest

from leo_diffmodel.bags.importing.convert import import_logs
from leo_diffmodel.bags.recording import read_bag
from leo_diffmodel.verbs.import_logs import main
from leo_sim.description.robot import load_robot

MAP = """
columns: {half: 1 / q}
time: t
joints: {pivot: {position: q, velocity: dq}}
inputs: {pivot: {voltage: u, enabled: 'on', supply_voltage: half}}
"""
HEAD = 't,q,dq,u,on\n'
GAPS = HEAD + '0,1,0,1,1\n,1,0,1,1\n1,inf,0,1,1\n1,1,0,1,1\n2,1,nan,1,1\n3,1,0,1,1\n4,2,0,1,1\n'
WHOLE = HEAD + '0,0,,,0\n1,1,,,0\n2,inf,,,0\n3,2,,,0\n'


def written(folder: Path, **logs: str) -> list[str]:
    (folder / 'map.yaml').write_text(MAP)
    for name, text in logs.items():
        (folder / f'{name}.csv').write_text(text)
    return [str(folder / f'{name}.csv') for name in logs]


@pytest.fixture(autouse=True)
def _no_warnings():
    with warnings.catch_warnings():
        warnings.simplefilter('error')
        yield


def test_a_line_for_each_log_says_which_rows_are_left_out(tmp_path, capsys):
    logs = written(tmp_path, gaps=GAPS, good=WHOLE.replace('2,inf,,,0\n', ''))
    words = [*logs, '--map', str(tmp_path / 'map.yaml'), '-o']
    assert main([*words, str(tmp_path / 'bag')]) == 0
    left = (
        f'{logs[0]}: 4 of 7 rows left out: 1 without a time, 1 with the time of the row before, '
        '2 without a number for q or dq'
    )
    lines = capsys.readouterr().out.splitlines()
    assert [line for line in lines if 'left out' in line] == [left]
    assert main([*words, str(tmp_path / 'other'), '--json']) == 0
    assert json.loads(capsys.readouterr().out)['bags'][0]['left_out'] == [left]


def test_an_infinite_number_is_none_and_a_motor_that_is_off_needs_no_input(tmp_path):
    (log,) = written(tmp_path, off=WHOLE)
    recording = read_bag(
        import_logs([log], tmp_path / 'map.yaml', tmp_path / 'bag'), load_robot('pendulum')
    )
    assert recording.episodes[0].q[:, 0].tolist() == [0.0, 1.0, 2.0]
    assert not recording.episodes[0].enabled.any()
    assert not np.isinf(recording.episodes[0].q).any()


def test_a_column_of_the_motor_that_drives_nothing_may_hold_no_number(tmp_path):
    (log,) = written(tmp_path, driven=HEAD + '0,0,,1,1\n1,1,,1,1\n2,2,,1,1\n')
    (tmp_path / 'map.yaml').write_text(MAP.replace('supply_voltage: half', 'supply_voltage: dq'))
    recording = read_bag(
        import_logs([log], tmp_path / 'map.yaml', tmp_path / 'bag'), load_robot('pendulum')
    )
    assert recording.input == 'voltage'
