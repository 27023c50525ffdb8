# SPDX-License-Identifier: Apache-2.0
"""The second process: the same results in the same order, and none where it is not wanted."""

from functools import partial
import operator
import os
import time
from unittest import mock

from joblib import delayed, Parallel
import pytest
from tests.searched import among
from tests.simulate import record, TORQUE

from leo_diffmodel.explain.estimate import helper
from leo_diffmodel.explain.explanation import explain
from leo_sim.effects import place
from leo_sim.model import Model


@pytest.fixture(scope='module', autouse=True)
def _no_helper_is_left():
    yield
    while helper._pools:
        helper._pools.pop().shutdown(wait=True)


@pytest.fixture
def two_cores():
    """A helper that has started, for one test."""
    with mock.patch.object(helper, 'cpu_count', return_value=2):
        helper.prepare(explain)
        helper._started[0].result()
        yield
    helper.prepare(explain, False)


def _pid(item: int) -> tuple[int, int]:
    time.sleep(0.05)
    return item, os.getpid()


def test_another_process_takes_its_share_and_all_comes_in_order(two_cores):
    told = []
    found = helper.spread(_pid, range(7), told.append)
    assert [item for item, _ in found] == list(range(7)) and sorted(told) == list(range(7))
    pids = [pid for _, pid in found]
    assert len(set(pids)) == 2 and pids[0] == os.getpid() and pids.count(pids[1]) >= 2


def test_what_a_killed_helper_leaves_is_done_here(two_cores):
    here = os.getpid()
    found = helper.spread(partial(_or_die, here), [1, 2, 3])
    assert found == [1, 2, 3] and not helper._started


def _or_die(here: int, item: int) -> int:
    if os.getpid() != here:
        os._exit(9)
    return item


def test_errors_of_either_half_come_through(two_cores):
    for items in ([0, 1], [1, 0]):
        with pytest.raises(ZeroDivisionError):
            helper.spread(partial(operator.floordiv, 1), items)


@pytest.mark.parametrize('cores, wanted', [(1, True), (2, False)])
def test_without_need_none_is_started(cores, wanted):
    with mock.patch.object(helper, 'cpu_count', return_value=cores):
        helper.prepare(explain, wanted)
    assert {pid for _, pid in helper.spread(_pid, range(3))} == {os.getpid()}


def test_an_explanation_is_the_same_with_and_without(two_cores, monkeypatch):
    among(monkeypatch, Model(TORQUE), 'coulomb_friction', 'viscous_friction', 'stribeck_friction')
    data = [record(TORQUE, place(TORQUE, 'coulomb_friction', 'pivot', c=0.2), seconds=10)]
    started = list(helper._started)
    with mock.patch.object(helper, 'prepare'):
        with_help = explain(data, Model(TORQUE)).to_json()
        assert helper._started == started
        helper._started.clear()
        alone = explain(data, Model(TORQUE)).to_json()
    for answer in (with_help, alone):
        del answer['seconds'], answer['provenance']
    assert with_help == alone


def test_joblib_goes_on_beside_it(two_cores):
    assert helper.spread(operator.neg, [1, 2]) == [-1, -2]
    assert Parallel(n_jobs=2)(delayed(operator.neg)(k) for k in range(3)) == [0, -1, -2]
    assert helper.spread(operator.neg, [1, 2]) == [-1, -2] and helper._started


def test_after_the_time_nothing_is_begun_and_what_is_done_is_kept(two_cores):
    assert helper.spread_until(0.0, _pid, range(4)) == {}
    until = time.monotonic() + 3600.0
    assert helper.spread_until(until, operator.neg, range(9)) == {i: -i for i in range(9)}
    assert helper._each(0.0, operator.neg, [1, 2]) == []


def test_what_the_other_process_had_no_time_for_is_left_out():
    lent = helper._Lent([1, 4], mock.Mock(result=lambda: [-1]))
    assert helper._received(lent, operator.neg, range(5)) == {1: -1}
