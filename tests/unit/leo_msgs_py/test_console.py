# SPDX-License-Identifier: Apache-2.0
"""Tables fold what is too wide; they cut nothing."""

import io
import time

import numpy as np
import pytest
from rich.table import Column
from tests.patience import PATIENCE

from leo_msgs_py import console
from leo_msgs_py.console import Clock, progress, Reporter, Table, Terminal
from leo_msgs_py.terminal import visible_output

NAMES = ('command_delay', 'load_dependent_friction:shoulder_lift')


def test_names_are_never_cut_at_80_columns():
    table = Table('effect', title='effects')
    for column in ('found from', 'named from', 'unit', 'size', 'seconds', 'most like'):
        table.add_column(column, justify='right')
    for name in NAMES:
        table.add_row(name, '0.0123', '0.0456', 'N m s2/rad2', '0.1', '120', f'{NAMES[1]} (9.9)')
    text = io.StringIO()
    Terminal(file=text, width=80).print(table)
    lines = text.getvalue().splitlines()
    assert '…' not in text.getvalue() and max(map(len, lines)) <= 80
    first = ''.join(line.split('│')[1].strip() for line in lines if line.startswith('│'))
    assert all(name in first for name in NAMES)


def test_what_is_too_wide_lacks_its_last_columns_and_says_so():
    table = Table(Column('effect', no_wrap=True), 'unit', 'most like', 'seconds', spare=2)
    table.add_row(NAMES[1], 'N m', NAMES[1], '10')
    for width, lacks in ((60, ['most like', 'seconds']), (90, ['seconds']), (120, [])):
        text = io.StringIO()
        Terminal(file=text, width=width).print(table)
        said = ' '.join(text.getvalue().split())
        assert [h for h in ('most like', 'seconds') if f'┃ {h}' not in said] == lacks
        assert NAMES[1] in said and ('left out' in said) == bool(lacks)


def test_a_name_that_leaves_no_room_is_folded_and_nothing_is_cut():
    table, text = Table(Column('effect', no_wrap=True), 'found from'), io.StringIO()
    table.add_row('x' * 42, '0.0013')
    Terminal(file=text, width=40).print(table)
    assert text.getvalue().count('x') == 42 and '0.0013' in text.getvalue()


def test_a_bar_draws_itself_and_no_name_in_it_is_obeyed(monkeypatch):
    text = io.StringIO()
    text.isatty = lambda: True
    monkeypatch.setattr('sys.stderr', text)
    monkeypatch.setenv('TERM', 'xterm')
    with visible_output(), progress('explaining', 2) as told:
        told('drag\x1b[2J')
    shown = text.getvalue()
    assert '\x1b[2K' in shown and r'\x1b[2K' not in shown
    assert 'explaining: drag' in shown and 'drag\x1b[2J' not in shown


class Time:
    at = 0.0

    def __call__(self):
        return self.at


def clock_after(steps, pace, done):
    at = Time()
    clock = Clock(steps, at)
    for _ in range(done):
        at.at += pace
        clock.step()
    return at, clock


def test_the_time_left_follows_the_pace():
    _, clock = clock_after(10, 2.0, 4)
    assert clock.left == 12.0 * 1.5  # and half as much, as four steps say little
    assert str(clock) == '8 s, about 18 s left'


def test_steps_are_measured_by_those_of_the_same_kind():
    clock = Clock(now=(at := Time()))
    clock.expect({'scan': 20, 'fit': 4})
    for kind, seconds in [('', 9.0), *2 * [('scan', 0.5)], ('fit', 10.0)]:
        at.at += seconds
        clock.step(int(bool(kind)), kind)
    assert clock.left is None  # one fit may be unlike the others
    at.at += 14.0
    clock.step(1, 'fit')
    assert clock.left == pytest.approx((18 * 0.5 + 2 * 12.0) * (1 + 0.5**0.5))


def said(seconds):
    """What is said of the time left by a clock of 30 steps, each of which takes so long [s]."""
    clock = Clock(30, at := Time())
    for each in seconds:
        for _ in range(8):
            at.at += each / 8
            yield clock.left
        clock.step()


@pytest.mark.parametrize('slow', [(), (3.0,), (60.0,), (3.0, 3.0, 3.0), (60.0, 0.1, 60.0)])
def test_what_is_left_never_grows_by_more_than_a_fifth_and_never_stands_at_nothing(slow):
    told = [left for left in said([1.0] * 10 + [*slow] + [1.0] * 25) if left is not None]
    assert len(told) > 50 and np.all(np.diff(told) <= 0.0) and told[-1] > console.LEAST


@pytest.mark.parametrize(('expected', 'done'), [(10, 12), (10, 1), (None, 5)])
def test_more_steps_than_expected_and_few_say_nothing(expected, done):
    assert clock_after(expected, 1.0, done)[1].left is None


def test_a_step_that_is_as_long_as_several_counts_as_them():
    at, clock = clock_after(100, 2.0, 0)
    for steps in (1, 2, 7):
        at.at += 2.0 * steps
        clock.step(steps)
    assert clock.left == pytest.approx(180.0 * (1 + 10**-0.5))


def test_no_more_time_is_left_than_there_is():
    clock = Clock(100, at := Time(), within=30.0)
    assert str(clock) == '0 s, at most 30 s left'
    for _ in range(4):
        at.at += 5.0
        clock.step()
    assert clock.left == 10.0


def test_what_is_to_come_is_told_as_it_is_known():
    clock, shown = Clock(None, at := Time()), []
    told = Reporter(shown.append, clock)
    assert Reporter.of(told) is told
    told('noise')
    assert (str(clock), clock.left) == ('0 s', None)
    told.expect({'': 20})
    at.at += 20.0
    told('friction', 4)
    assert shown == ['noise', 'friction'] and str(clock) == '20 s, about 93 s left'


def test_who_hears_words_alone_is_told_no_steps():
    heard = []
    told = Reporter.of(heard.append)
    told.expect({'': 3})
    told('friction', 8)
    assert heard == ['friction']


def test_piped_lines_come_while_a_step_lasts(capsys, monkeypatch):
    monkeypatch.setattr(console, 'EVERY', 0.001)
    lines, end = '', time.monotonic() + PATIENCE
    with console.progress('explaining', 10) as told:
        told('friction')
        while lines.count('explaining: friction (') < 2:
            assert time.monotonic() < end
            lines += capsys.readouterr().err


def test_piped_and_short_nothing_is_printed(capsys):
    with console.progress('explaining', 10) as told:
        told('friction')
    assert capsys.readouterr().err == ''
