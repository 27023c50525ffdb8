# SPDX-License-Identifier: Apache-2.0
"""The pages hold what the lines of results say."""

import json

from benchmarks import blind_tables
import pytest
from tests.judging import answered

from leo_lab.blind import suite

PAGES = [page for page in blind_tables.pages() if blind_tables.MARKED.search(page.read_text())]


def line(seed, kind='none', **more):
    known = {'right': True, 'cpu_seconds': 2.0, 'commit': 'c1', 'machine': 'm'}
    return answered(kind, seed, **known | more)


@pytest.fixture
def results(tmp_path, monkeypatch):
    monkeypatch.setattr(blind_tables, 'RESULTS', tmp_path)
    return tmp_path / 'lines.jsonl'


def add(results, *lines):
    with results.open('a') as file:
        file.writelines(json.dumps(one) + '\n' for one in lines)


@pytest.mark.parametrize('page', PAGES, ids=lambda page: page.name)
def test_a_page_holds_what_the_lines_say(page):
    again = 'run python benchmarks/blind_tables.py'
    assert blind_tables.written(page) == page.read_text(), again


def test_all_pages_of_rates_are_marked():
    assert {page.name for page in PAGES} >= {'README.md', 'rates.md'}


def test_a_table_counts_by_world_and_names_commits(results):
    add(results, line(1), line(2, engine='mujoco', right=False), line(3, commit='c2'))
    told = blind_tables.table('worlds lines.jsonl')
    assert '| hidden | what | all | rk4 | MuJoCo |' in told
    assert '2 of 3, 66.7 % (20.8 to 93.9) | 2 of 2, 100.0 % (34.2 to 100.0) | 0 of 1' in told
    assert '3 lines of `lines.jsonl`, commit c1, c2; m.' in told
    assert '| 2 | pendulum | MuJoCo | - | fine |' in blind_tables.table('wrong lines.jsonl')


def test_an_overview_counts_the_lines_of_each_robot(results, tmp_path):
    held = [{'error': 0.1, 'inside': True, 'parameter': 'm'}]
    add(results, line(1), line(2, right=False))
    (tmp_path / 'more.jsonl').write_text(
        json.dumps(line(1, kind='effect', family=True, right=False, robot='leo', errors=held))
    )
    told = blind_tables.table('overview lines.jsonl more.jsonl')
    assert '| four with a fixed base | - | - | 1 of 2 | - | - | -, - |' in told
    assert '| LEO | 0 of 1 | 1 of 1 | - | - | - | 100.0 %, - |' in told
    assert '| a position servo |' not in told


def test_no_table_of_lines_that_are_not_there_or_not_to_be_seen(results):
    assert 'is not there yet' in blind_tables.table('rates lines.jsonl')
    suite.begin(results, suite.here(60_001, 0.1, True)._replace(commit='c1'), True)
    add(results, line(60_001))
    assert 'open examination' in blind_tables.table('rates lines.jsonl')
    suite.close(results)
    assert '1 of 1, 100.0 %' in blind_tables.table('rates lines.jsonl')


def test_a_page_keeps_what_is_between_the_tables(results, tmp_path, monkeypatch, capsys):
    page = tmp_path / 'page.md'
    marked = '<!-- blind_tables: wrong lines.jsonl -->\n<!-- end of table -->\n'
    page.write_text(f'before\n{marked}end\n')
    add(results, line(1, right=False))
    monkeypatch.setattr(blind_tables, 'ROOT', tmp_path)
    for words, status in (['--check'], 1), ([], 0), (['--check'], 0):
        monkeypatch.setattr('sys.argv', ['blind_tables', *words])
        assert blind_tables.main() == status
    assert page.read_text().splitlines()[2:] == [
        '| seed | robot | simulated by | hidden | answer |',
        '| --- | --- | --- | --- | --- |',
        '| 1 | pendulum | rk4 | - | fine |',
        '<!-- end of table -->',
        'end',
    ]
    assert 'page.md: not what the lines say' in capsys.readouterr().out
