# SPDX-License-Identifier: Apache-2.0
"""How many cores are used, and that threads change no number."""

from functools import partial
import os
import signal
import subprocess
import sys
import threading

import numpy as np
import pytest

from leo_msgs_py.ending import SIGNALS
from leo_sim.common.cores import at_once, cores, in_processes, parts, using
from leo_sim.dynamics import whole_windows
from leo_sim.model import Model
from leo_sim.model.batch import rollout


@pytest.mark.parametrize('name', ['OMP_NUM_THREADS', 'LOKY_MAX_CPU_COUNT'])
def test_the_environment_limits_the_cores_and_a_choice_goes_first(name):
    said = 'from leo_sim.common.cores import *; print(cores())\nwith using(8): print(cores())'
    env = {**os.environ, 'LOKY_MAX_CPU_COUNT': '64', name: '1'}
    found = subprocess.run([sys.executable, '-c', said], env=env, capture_output=True, text=True)
    assert found.stdout.split() == ['1', '8']


def test_a_choice_is_over_with_its_block():
    before = cores()
    with using(3), using(None):
        assert cores() == 3
    assert cores() == before


def test_parts_are_whole_and_no_smaller_than_worth_a_thread():
    with using(4):
        assert [*map(len, map(range(10).__getitem__, parts(10, 100, 10)))] == [2, 3, 2, 3]
        assert len(parts(10, 25, 10)) == 2 and parts(0, 0, 10) == [slice(0, 0)]


def test_parts_go_to_threads_of_their_own():
    meet = threading.Barrier(3, timeout=20.0)
    assert sorted(at_once(lambda _: meet.wait(), range(3))) == [0, 1, 2]


def test_processes_leave_the_signals_of_a_terminal_to_the_one_that_started_them():
    blocked = partial(signal.pthread_sigmask, signal.SIG_BLOCK)
    for found in in_processes(2, blocked, [(), ()], return_as='generator'):
        assert {*SIGNALS} <= found
    assert not {*SIGNALS} & blocked(())


@pytest.mark.parametrize('robot', ['torque_pendulum', 'double_pendulum'])
def test_windows_of_several_threads_have_the_numbers_of_one(robot, monkeypatch):
    monkeypatch.setattr(whole_windows, 'LEAST', 1)
    model, rng = Model(robot), np.random.default_rng(3)
    size, inputs = len(model.robot.joint_names), len(model.robot.actuators)
    q, dq = rng.normal(size=(2, 3, 7, size))
    given = q, dq, rng.normal(size=(7, 20, inputs)), 0.01
    found = []
    for number in (1, 5):
        with using(number):
            found.append(rollout(model, *given))
    assert np.array_equal(*map(np.stack, found)) and np.isfinite(found[0]).all()
