# SPDX-License-Identifier: Apache-2.0
"""`leo reproduce`: shares, what stands beside them, cases that are not run twice."""

import json

import pytest

from leo_lab.thesis.table7 import share, shares
from leo_lab.verbs.reproduce import main
from leo_msgs_py.errors import UserError

CASE = {
    'truth': 'moved',
    'repair': 'recommended',
    'transitions': 5000,
    'config': 'recommended',
    'steps': 10_000,
    'more_steps': 5000,
    'mse_before': 2.0,
    'mse_after': 0.002,
}
ROWS = [
    {**CASE, 'seed': 0, 'return_ideal': -900.0, 'return_repaired': -310.0, 'return_real': -300.0},
    {**CASE, 'seed': 1, 'return_ideal': -1100.0, 'return_repaired': -290.0, 'return_real': -350.0},
]
THESIS = {**ROWS[0], 'repair': 'thesis', 'mse_after': 0.2}


@pytest.fixture
def results(tmp_path):
    path = tmp_path / 'table7.jsonl'
    path.write_text(''.join(json.dumps(row) + '\n' for row in [*ROWS, THESIS]))
    return path


def test_share_is_of_the_best_reference():
    assert shares(ROWS) == [590 / 600, 810 / 800]
    assert share(ROWS) == pytest.approx(700 / 700)


def test_finished_cases_are_read_and_others_stand_beside(results, capsys):
    assert main(['table7', '--seeds', '2', '--results', str(results), '--json']) == 0
    said = json.loads(capsys.readouterr().out)
    assert said['n'] == 2 and said['mse_down_percent'] == [pytest.approx(99.9)] * 2
    [beside] = said['beside']
    assert beside['repair'] == 'thesis' and beside['mse_after_mean'] == 0.2
    assert main(['table7', '--seeds', '2', '--results', str(results)]) == 0
    assert 'beside it: repair thesis' in capsys.readouterr().out


def test_a_gap_left_open_is_a_negative_answer(results):
    results.write_text(json.dumps(ROWS[1] | {'seed': 0, 'return_repaired': -600.0}))
    assert main(['table7', '--seeds', '1', '--results', str(results)]) == 1


def test_the_first_seeds_alone(tmp_path, capsys):
    told = ['--results', str(tmp_path), '--folder', str(tmp_path), '--plan', '--json']
    for seeds, cases in (('1', 2), ('3', 6), ('9', 8)):
        assert main(['table6', *told, '--seeds', seeds]) == 0
        assert json.loads(capsys.readouterr().out)[0]['cases'] == cases
    with pytest.raises(UserError, match='--seeds takes 1 or more'):
        main(['table6', *told, '--seeds', '0'])
