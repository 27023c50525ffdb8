# SPDX-License-Identifier: Apache-2.0
"""Trials by processes: the results of one, in order, and no process where none is wanted."""

from contextlib import nullcontext
from functools import partial
import json
import operator
import os
import time
from unittest import mock

import pytest
from tests.searched import among
from tests.simulate import bag, record, TORQUE

from leo_diffmodel.explain.estimate import trials
from leo_diffmodel.explain.explanation import explain
from leo_msgs_py.cli import main
from leo_sim.common.cores import using
from leo_sim.effects import place
from leo_sim.model import Model


@pytest.fixture
def two():
    """Two processes that have started, for one test."""
    with using(2), trials.by_processes(explain, 0.0):
        assert not trials._processes[-1].ready() and trials._processes[-1].there.wait(60.0)
        yield


def _pid(item: int) -> tuple[int, int]:
    time.sleep(0.05)
    return item, os.getpid()


def test_processes_share_a_list_and_all_comes_in_order(two):
    told: list[int] = []
    found = trials.spread(_pid, range(9), told.append)
    assert [item for item, _ in found] == told == list(range(9))
    assert len({pid for _, pid in found} - {os.getpid()}) == 2


def test_what_a_killed_process_leaves_is_done_here_and_so_is_the_rest(two):
    here = os.getpid()
    assert trials.spread(partial(_or_die, here), range(5)) == [*range(5)]
    assert {pid for _, pid in trials.spread(_pid, range(3))} == {here}


def _or_die(here: int, item: int) -> int:
    if item and os.getpid() != here:
        os._exit(9)
    return item


def test_an_error_comes_through(two):
    with pytest.raises(ZeroDivisionError):
        trials.spread(partial(operator.floordiv, 1), [1, 0, 1])


@pytest.mark.parametrize(('jobs', 'after', 'able'), [(1, 0, True), (2, 9, True), (2, 0, False)])
def test_without_need_or_too_early_none_is_started(jobs, after, able):
    with using(jobs), trials.by_processes(explain, after, able):
        assert {pid for _, pid in trials.spread(_pid, range(3))} == {os.getpid()}


def test_one_job_and_many_write_the_same_explain_json(two, monkeypatch, tmp_path):
    among(monkeypatch, Model(TORQUE), 'coulomb_friction', 'viscous_friction', 'stribeck_friction')
    placed = place(TORQUE, 'coulomb_friction', 'pivot', c=0.2)
    path = str(bag(tmp_path / 'bag', record(TORQUE, placed, seconds=10)))
    monkeypatch.setattr(trials, 'by_processes', lambda *_: nullcontext())  # those that there are
    sent, found = mock.Mock(side_effect=trials._parallel), []
    monkeypatch.setattr(trials, '_parallel', sent)
    for jobs in ('2', '1'):
        words = [path, '--model', 'torque_pendulum', '--jobs', jobs, '-o', str(tmp_path / jobs)]
        assert main(['explain', *words]) == 0
        told = json.loads((tmp_path / jobs / 'explain.json').read_text())
        found.append({k: v for k, v in told.items() if k not in ('seconds', 'provenance')})
        assert sent.called
        monkeypatch.setattr(trials, '_processes', [])
        sent.side_effect = AssertionError
    assert found[0] == found[1]


@pytest.mark.parametrize('jobs', ['0', 'all', '-1'])
def test_what_is_no_number_of_cores_is_said(jobs, capsys):
    assert main(['explain', 'bag', '--model', 'pendulum', f'--jobs={jobs}']) == 2
    assert f"'{jobs}' is no number of cores; give 1 or more" in capsys.readouterr().err


@pytest.mark.parametrize('jobs', [1, 2])
def test_after_the_time_nothing_is_begun(two, jobs):
    with using(jobs):
        assert trials.spread_until(0.0, _pid, range(4)) == {}
        late = time.monotonic() + 0.2
        found = trials.spread_until(late, _pid, range(60))
    assert found and len(found) < 60 and all(n == item for n, (item, _) in found.items())
