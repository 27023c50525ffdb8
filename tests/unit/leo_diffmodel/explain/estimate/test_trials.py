# SPDX-License-Identifier: Apache-2.0
"""Trials by processes: the results of one, in order, and no process where none is wanted."""

from contextlib import nullcontext
from functools import partial
import operator
import os
import time

import pytest
from tests.searched import among
from tests.simulate import record, TORQUE

from leo_diffmodel.explain.estimate import trials
from leo_diffmodel.explain.explanation import explain
from leo_sim.common.cores import using
from leo_sim.effects import place
from leo_sim.model import Model


@pytest.fixture
def two():
    """Two processes that have started, for one test."""
    with using(2), trials.by_processes(explain, 0.0):
        assert trials._starts[-1].finished.wait(60.0)
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


def test_explanations_with_many_jobs_and_with_one_are_the_same(two, monkeypatch):
    among(monkeypatch, Model(TORQUE), 'coulomb_friction', 'viscous_friction', 'stribeck_friction')
    data = [record(TORQUE, place(TORQUE, 'coulomb_friction', 'pivot', c=0.2), seconds=10)]
    monkeypatch.setattr(trials, 'by_processes', lambda *_: nullcontext())  # those that there are
    many = explain(data, Model(TORQUE)).to_json()
    monkeypatch.setattr(trials, '_starts', [])
    with using(1):
        one = explain(data, Model(TORQUE)).to_json()
    for answer in (many, one):
        del answer['seconds'], answer['provenance']
    assert many == one


@pytest.mark.parametrize('jobs', [1, 2])
def test_after_the_time_nothing_is_begun(two, jobs):
    with using(jobs):
        assert trials.spread_until(0.0, _pid, range(4)) == {}
        late = time.monotonic() + 0.2
        found = trials.spread_until(late, _pid, range(60))
    assert found and len(found) < 60 and all(n == item for n, (item, _) in found.items())
