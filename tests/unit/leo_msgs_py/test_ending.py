# SPDX-License-Identifier: Apache-2.0
"""A signal or a time that is over ends what is under way, even where the first try gets lost."""

from contextlib import suppress
import math
import signal
import subprocess
import sys
import threading
import time

import pytest
from tests.patience import PATIENCE

from leo_msgs_py.ending import BEGAN, Ended, ending, process_began, told_when_ended

PARENT = """
import subprocess, sys, time
code = 'import os, time; from leo_msgs_py.ending import end_with; end_with(os.getppid()); '
subprocess.Popen([sys.executable, '-c', code + 'print(1, flush=True); time.sleep(600)'])
time.sleep(600)
"""


def test_a_helper_ends_with_the_process_that_started_it_though_that_is_killed():
    parent = subprocess.Popen([sys.executable, '-c', PARENT], stdout=subprocess.PIPE)
    assert parent.stdout and parent.stdout.readline() == b'1\n'
    parent.kill()
    assert parent.communicate(timeout=PATIENCE) == (b'', None), 'nobody holds the pipe any more'


def wait() -> None:
    end = time.monotonic() + PATIENCE
    while time.monotonic() < end:
        time.sleep(0.01)


def handlers() -> list:
    return [signal.getsignal(n) for n in (signal.SIGINT, signal.SIGTERM, signal.SIGALRM)]


@pytest.mark.parametrize('number', [signal.SIGTERM, signal.SIGINT, signal.SIGHUP])
def test_a_signal_ends_it_with_the_status_of_a_shell_and_a_line(number, capsys):
    before = handlers()
    with pytest.raises(Ended) as found, told_when_ended():
        signal.raise_signal(number)
    (line,) = capsys.readouterr().err.splitlines()
    assert line.startswith(f'leo: ended by {signal.Signals(number).name}: no answer is kept;')
    assert found.value.status == 128 + number and not found.value.in_time
    assert handlers() == before and signal.getitimer(signal.ITIMER_REAL) == (0.0, 0.0)


def test_it_is_raised_again_where_compiled_code_has_dropped_it():
    def dropped() -> None:
        with suppress(Ended):
            signal.raise_signal(signal.SIGTERM)
        wait()

    with pytest.raises(Ended) as found, ending():
        dropped()
    assert found.value.number == signal.SIGTERM


@pytest.mark.parametrize('within', [0.0, 0.6])
def test_a_time_that_is_over_ends_it_too(within):
    with pytest.raises(Ended) as found, ending(time.monotonic() + within):
        wait()
    assert found.value.in_time


def test_what_is_done_before_and_what_other_threads_do_is_left_alone():
    with ending(time.monotonic() + PATIENCE):
        pass
    with ending(math.inf):
        pass
    reached = []

    def elsewhere() -> None:
        with ending():
            reached.append(True)

    thread = threading.Thread(target=elsewhere)
    thread.start()
    thread.join()
    assert reached and signal.getitimer(signal.ITIMER_REAL) == (0.0, 0.0)


def test_a_process_began_before_now_and_a_command_is_no_longer_running():
    assert time.monotonic() - 24 * 3600 < process_began() <= time.monotonic()
    assert BEGAN.get(None) is None
