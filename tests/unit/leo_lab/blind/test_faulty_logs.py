# SPDX-License-Identifier: Apache-2.0
"""Faults of logs as cases of the benchmark."""

import pytest

from leo_lab.blind import faulty_logs
from leo_lab.blind.run_cases import run
from leo_lab.blind.table import summary


@pytest.fixture(scope='module')
def lines(tmp_path_factory):
    """A log with a fault and one without, and the file that they were written to."""
    results = tmp_path_factory.mktemp('logs') / 'results.jsonl'
    return run([1001], 'fault', results) + run([1001], 'sound', results), results


def test_a_fault_is_judged_by_its_name_and_size(lines):
    (fault, sound), _ = lines
    assert fault['effects'][0]['name'] == fault['named'][0][0] and fault['right']
    assert fault['errors'][0]['error'] < 0.05 and fault['errors'][0]['inside']
    assert (sound['effects'], sound['errors'], sound['right']) == ([], [], True)


def test_they_are_counted_and_not_run_again(lines, monkeypatch):
    (fault, sound), results = lines
    monkeypatch.setattr(faulty_logs, 'run_case', None)
    assert run([1001], 'fault', results) == [fault]
    for line in (fault, sound):
        assert summary(line['kind'], [line])['right']['hits'] == 1


def test_another_fault_than_the_hidden_one_is_not_right(monkeypatch):
    monkeypatch.setattr(faulty_logs, 'find_faults', lambda *_: [])
    assert not faulty_logs.run_case(1001, 'fault')['right']
    assert faulty_logs.run_case(1001, 'sound')['right']
