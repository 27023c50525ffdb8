# SPDX-License-Identifier: Apache-2.0
"""The time left is never less than the step takes that is being done; piped, lines come."""

from leo_msgs_py import progress
from leo_msgs_py.progress import Clock


class Time:
    def __init__(self):
        self.at = 0.0

    def __call__(self):
        return self.at


def clock_after(steps, pace, done):
    time = Time()
    clock = Clock(steps, time)
    for _ in range(done):
        time.at += pace
        clock.step()
    return time, clock


def test_the_time_left_follows_the_pace():
    _, clock = clock_after(10, 2.0, 4)
    assert clock.left == 12.0
    assert str(clock) == '8 s, about 12 s left'


def test_a_last_step_that_takes_minutes_has_not_one_second_left():
    time, clock = clock_after(10, 1.0, 9)
    assert clock.left == 1.0
    time.at += 240.0
    assert clock.left == 240.0
    assert str(clock) == '4 min, about 4 min left'


def test_more_steps_than_expected_and_few_say_nothing():
    assert clock_after(10, 1.0, 12)[1].left is None
    assert clock_after(10, 1.0, 1)[1].left is None
    assert clock_after(None, 1.0, 5)[1].left is None


def test_a_step_that_is_as_long_as_several_counts_as_them():
    time, clock = clock_after(100, 2.0, 0)
    for steps in (1, 2, 7):
        time.at += 2.0 * steps
        clock.step(steps)
    assert clock.left == 180.0


def test_piped_a_line_comes_now_and_then(capsys, monkeypatch):
    monkeypatch.setattr(progress, 'EVERY', 0.0)
    with progress.progress('explaining', 10) as told:
        told('friction')
    assert capsys.readouterr().err.startswith('explaining: friction (')


def test_piped_and_short_nothing_is_printed(capsys):
    with progress.progress('explaining', 10) as told:
        told('friction')
    assert capsys.readouterr().err == ''
