# SPDX-License-Identifier: Apache-2.0
"""Work done by processes of this machine and by a Dask cluster whose workers are killed."""

import argparse
import os
import signal
import sys
import time

import pytest
from tests.cluster import local_cluster

from leo_diffmodel.fleet import workers
from leo_diffmodel.fleet.workers import Workers
from leo_lab.workers import chosen_workers
from leo_msgs_py.errors import UserError


def slow(item):
    """A number, and who made it."""
    time.sleep(0.1)
    return item, os.getpid()


def deadly(item):
    if item == 'dies':
        os._exit(9)
    return item


@pytest.fixture(scope='module')
def cluster():
    with local_cluster(2) as found:
        yield found


@pytest.mark.parametrize('jobs', [1, 2])
def test_processes_give_every_result_once(jobs):
    done = list(Workers(jobs).each(slow, range(5)))
    assert sorted(item for item, _ in done) == list(range(5))
    assert (os.getpid() in {pid for _, pid in done}) == (jobs == 1)


def test_no_work_needs_no_scheduler():
    assert list(Workers(1, 'tcp://127.0.0.1:1').each(slow, [])) == []


def test_a_killed_worker_loses_nothing_and_nothing_is_counted_twice(cluster):
    done = []
    for item, pid in Workers(1, cluster.scheduler_address).each(slow, range(40)):
        done.append(item)
        if item in (3, 9, 15):
            os.kill(pid, signal.SIGKILL)
    assert sorted(done) == list(range(40))


def test_what_ends_every_worker_is_given_up_and_what_waited_behind_it_is_not(cluster):
    """Each worker has several things to do, and all of them die with it at once."""
    cluster.scheduler.allowed_failures = 0
    innocent, done = list(range(20)), []
    results = Workers(1, cluster.scheduler_address).each(deadly, ['dies', *innocent])
    with pytest.raises(UserError, match='1 of 21 pieces of work were given up'):
        done.extend(results)
    assert sorted(done) == innocent


def test_one_line_says_what_a_cluster_lacks(monkeypatch):
    monkeypatch.setattr(workers, 'CONNECT', 0.5)
    with pytest.raises(UserError, match='no Dask scheduler answers there'):
        next(Workers(1, 'tcp://127.0.0.1:1').each(slow, [1]))
    monkeypatch.setitem(sys.modules, 'distributed', None)
    options = argparse.Namespace(jobs=1, scheduler='tcp://127.0.0.1:1')
    with pytest.raises(UserError, match=r'pip install .leo_diffmodel\[cluster\]'):
        chosen_workers(options, 'leo blind')
