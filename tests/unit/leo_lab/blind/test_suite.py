# SPDX-License-Identifier: Apache-2.0
"""The whole benchmark in one file: its order, its commit, and when it may be looked into."""

from collections import Counter
import json

import pytest
from tests.judging import answered

from leo_lab import origin
from leo_lab.blind import run_cases, seeds, suite
from leo_lab.blind.case import engine_of, robot_name
from leo_lab.blind.outside import KINDS as LAWS
from leo_lab.blind.suite import CASES, Suite
from leo_lab.blind.table import SHARES
from leo_lab.verbs import blind
from leo_lab.verbs.blind import main
from leo_msgs_py.errors import UserError

FEW = {None: {'none': 3, 'effect': 2}, 'leo': {'none': 1}}


def fake(seed, kind, robot):
    if (seed, kind) == (60_002, 'effect'):
        raise ZeroDivisionError('somewhere')
    case = {'robot': robot or robot_name(seed), 'engine': engine_of(seed, bool(robot))[0]}
    return answered(kind, seed, **case, **dict.fromkeys(SHARES[kind], True))


@pytest.fixture
def few(monkeypatch):
    """A suite of six cases at commit c1 that nothing simulates."""
    monkeypatch.setattr(suite, 'CASES', FEW)
    monkeypatch.setattr(run_cases, 'run_case', fake)
    monkeypatch.setattr(blind, 'find_spec', lambda name: True)
    at_commit(monkeypatch, 'c1')


def at_commit(monkeypatch, name):
    for module in (origin, seeds, suite):
        monkeypatch.setattr(module, 'commit', lambda: name)


def examine(folder, *words):
    suite_words = ['--suite', '--examination', '--first-seed', '60001', '--jobs', '1', '-o']
    return main([*suite_words, str(folder), *words])


def of(share=1.0):
    return Suite(60_001, share, True, '', 'c1').tasks()


def test_the_whole_suite_has_every_case_once():
    tasks = of()
    wanted = {(w, kind): n for w, counts in CASES.items() for kind, n in counts.items()}
    assert Counter((task.robot, task.kind) for task in tasks) == wanted
    assert len(set(tasks)) == len(tasks)
    for task in tasks:
        assert 60_001 <= task.seed <= 60_000 + CASES[task.robot][task.kind]


@pytest.mark.parametrize('part', [0.1, 0.5])
def test_a_run_that_is_cut_off_holds_its_part_of_every_kind(part):
    tasks = of()
    done = Counter((t.robot, t.kind) for t in tasks[: round(part * len(tasks))])
    for walker, counts in CASES.items():
        for kind, count in counts.items():
            assert abs(done[walker, kind] - part * count) <= 1


def test_a_tenth_is_the_beginning_of_the_whole_and_has_all_robots_and_engines():
    tenth, whole = of(0.1), of()
    assert set(tenth) <= set(whole[: round(0.12 * len(whole))])
    fixed = [t for t in tenth if t.robot is None]
    for kind in ('effect', 'none', 'pair', 'small'):
        assert len({(robot_name(t.seed), t.seed % 2) for t in fixed if t.kind == kind}) == 8
    assert len({t.seed // 8 % len(LAWS) for t in fixed if t.kind == 'outside'}) >= 4


def test_a_suite_goes_on_is_closed_when_it_is_whole_and_told_only_then(few, tmp_path, capsys):
    results = tmp_path / 'suite.jsonl'
    assert examine(tmp_path) == 0
    assert 'suite.jsonl is closed' in capsys.readouterr().out
    lines = results.read_text().splitlines()
    assert len(lines) == 8 and json.loads(lines[-1])['missing'] == 0
    results.write_text('\n'.join(lines[:4]) + '\n' + lines[4][:30])
    with pytest.raises(UserError, match='an open examination, 3 of 6 cases'):
        main(['--table', str(results)])
    assert examine(tmp_path) == 0
    assert len(results.read_text().splitlines()) == 9  # one of them cut short
    told = capsys.readouterr().out
    assert main(['--table', str(results)]) == 0
    assert capsys.readouterr().out in told and 'leo: no effect, seeds 60001' in told


def test_a_case_that_ends_with_an_error_has_a_line_and_is_not_right(few, tmp_path, capsys):
    assert examine(tmp_path, '--json') == 0
    rates = json.loads(capsys.readouterr().out)['fixed base']
    assert (rates['effect']['cases'], rates['effect']['right']['hits']) == (2, 1)
    assert rates['confusion']['effect'] == {'-': {'fine': 1, 'error': 1}}


def test_what_fails_for_the_machine_runs_again(few, tmp_path, monkeypatch, capsys):
    def full(seed, kind, robot):
        raise MemoryError

    monkeypatch.setattr(run_cases, 'run_case', full)
    assert examine(tmp_path) == 1
    assert 'lacks 6 of 6 cases and is open' in ' '.join(capsys.readouterr().out.split())
    monkeypatch.setattr(run_cases, 'run_case', fake)
    assert examine(tmp_path) == 0


def test_a_suite_is_of_one_commit(few, tmp_path, monkeypatch):
    examine(tmp_path)
    at_commit(monkeypatch, 'c2')
    with pytest.raises(UserError, match=r'of commit c1, this code is c2; .*--any-commit'):
        examine(tmp_path)
    assert examine(tmp_path, '--any-commit') == 0
    at_commit(monkeypatch, 'c2+dirty')
    with pytest.raises(UserError, match='this tree has changes'):
        examine(tmp_path / 'other')
    assert not (tmp_path / 'other').exists()


def test_a_worker_with_other_code_is_refused(few, tmp_path, monkeypatch):
    monkeypatch.setattr(origin, 'commit', lambda: 'c0')
    with pytest.raises(UserError, match='runs commit c0, not c1'):
        examine(tmp_path)
    assert run_cases.read_lines(tmp_path / 'suite.jsonl') == []


@pytest.mark.parametrize(
    'words, said',
    [
        (('--share', '0.5'), 'another suite'),
        (('--first-seed', '60002'), 'another suite'),
        (('--share', '0'), '--share is more than 0'),
        (('--cases', '3'), 'leave out --cases'),
        (('--first-seed', '49999'), 'is for development'),
    ],
)
def test_other_cases_do_not_get_into_a_suite(few, tmp_path, words, said):
    examine(tmp_path)
    with pytest.raises(UserError, match=said):
        examine(tmp_path, *words)


def test_a_suite_may_be_closed_before_it_is_whole(few, tmp_path, capsys):
    results = tmp_path / 'suite.jsonl'
    suite.begin(results, suite.here(60_001, 1.0, True))
    assert main(['--close', str(results)]) == 1
    assert 'is closed; 6 cases have no line' in capsys.readouterr().out
    assert examine(tmp_path) == 1
    assert 'lacks 6 of 6 cases and was closed' in ' '.join(capsys.readouterr().out.split())
    results.write_text('{"kind": "none"}\n')
    with pytest.raises(UserError, match='holds no suite'):
        main(['--close', str(results)])


def test_a_part_has_a_file_of_its_own_and_is_the_same_cases(few, tmp_path):
    assert examine(tmp_path, '--part', 'fixed') == 0
    assert [f.name for f in tmp_path.iterdir()] == ['suite_fixed.jsonl']
    lines = run_cases.read_lines(tmp_path / 'suite_fixed.jsonl')
    assert {(x['kind'], x['seed']) for x in lines} == {
        (kind, seed) for kind, count in FEW[None].items() for seed in range(60_001, 60_001 + count)
    }
    with pytest.raises(UserError, match='another suite'):
        suite.begin(tmp_path / 'suite_fixed.jsonl', suite.here(60_001, 1.0, True, 'leo'))


def test_two_runs_do_not_add_to_one_suite(few, tmp_path):
    results = tmp_path / 'suite.jsonl'
    suite.begin(results, suite.here(60_001, 1.0, True))
    with suite.alone(results), pytest.raises(UserError, match='another run adds to'):
        examine(tmp_path)
    assert examine(tmp_path) == 0


@pytest.mark.parametrize('words', [['--share', '0.1'], ['--any-commit'], ['--part', 'leo']])
def test_what_is_of_the_suite_is_not_taken_without_it(words):
    with pytest.raises(UserError, match='are of --suite'):
        main(words)


def test_development_may_be_looked_into_while_it_runs(few, tmp_path):
    results = tmp_path / 'suite.jsonl'
    suite.begin(results, suite.here(1, 1.0, False))
    suite.check_readable(results)
    with pytest.raises(UserError, match='seed 60003 is for an examination'):
        suite.begin(tmp_path / 'other.jsonl', suite.here(60_001, 1.0, False))
