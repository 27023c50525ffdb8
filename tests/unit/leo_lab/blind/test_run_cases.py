# SPDX-License-Identifier: Apache-2.0
"""Blind cases one after the other: gone on with, each robot in a file of its own."""

import json

import pytest
from tests.judging import truth_of, verdict

from leo_lab.blind import run_cases
from leo_lab.verbs.blind import main


def test_a_run_continues_where_it_ended(tmp_path, monkeypatch):
    asked = []

    def fake(seed, kind, robot):
        asked.append((seed, kind))
        return {'seed': seed, 'kind': kind, 'right': True}

    monkeypatch.setattr(run_cases, 'run_case', fake)
    results = tmp_path / 'deep' / 'results.jsonl'
    assert [r['seed'] for r in run_cases.run(range(3), 'none', results)] == [0, 1, 2]
    run_cases.run(range(4), 'none', results)
    run_cases.run(range(1), 'pair', results)
    assert asked == [(0, 'none'), (1, 'none'), (2, 'none'), (3, 'none'), (0, 'pair')]
    assert len([json.loads(line) for line in results.read_text().splitlines()]) == 5


def test_a_robot_that_is_asked_for_has_a_file_of_its_own(tmp_path, monkeypatch, capsys):
    asked = []

    def fake(seed, kind, robot):
        asked.append(robot and robot.name)
        return verdict(truth_of(kind), 'fine') | {'seed': seed}

    monkeypatch.setattr(run_cases, 'run_case', fake)
    for words in ([], ['--robot', 'leo'], ['--robot', 'leo_ode'], ['--robot', 'leo']):
        assert main(['--no-effect', '1', '-o', str(tmp_path), '--jobs', '1', *words]) == 0
    assert asked == [None, 'leo', 'leo_ode']
    assert 'results_leo.jsonl; the same command again' in ' '.join(capsys.readouterr().out.split())
    assert {f.name: len(f.read_text().splitlines()) for f in tmp_path.iterdir()} == {
        'results.jsonl': 1,
        'results_leo.jsonl': 1,
        'results_leo_ode.jsonl': 1,
    }


@pytest.mark.parametrize('failing', [1, 3])
def test_cases_that_end_with_an_error_are_said_and_end_no_other(
    failing, tmp_path, monkeypatch, capsys
):
    def fake(seed, kind, robot):
        if seed <= failing:
            raise ValueError('no such robot')
        return verdict(truth_of(kind), 'fine') | {'seed': seed}

    monkeypatch.setattr(run_cases, 'run_case', fake)
    assert main(['--no-effect', '3', '-o', str(tmp_path), '--jobs', '1']) == 1
    said = capsys.readouterr()
    assert 'none 1 has no answer: ValueError' in said.err and 'Traceback' not in said.err
    assert len(run_cases.read_lines(tmp_path / 'results.jsonl')) == 3 - failing
