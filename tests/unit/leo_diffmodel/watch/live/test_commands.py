# SPDX-License-Identifier: Apache-2.0
"""A run is sent to the robot after a question; recording on and off."""

import time
from types import SimpleNamespace

import pytest
from tests.patience import until

from leo_diffmodel.watch.live import commands
from leo_diffmodel.watch.live.live import Live, SILENT, STOPPED
from leo_msgs_py.errors import UserError


@pytest.fixture
def clock():
    return [100.0]


@pytest.fixture
def sending(clock, tmp_path):
    """Asked about a run whose file is not there."""
    sending = commands.Sending(now=lambda: clock[0])
    sending.ask(commands.Sent(('play', str(tmp_path / 'none.csv')), 'steps', 2.0))
    yield sending
    sending.wait()


def test_a_question_that_expired_or_was_denied_moves_nothing(sending, clock):
    run = sending.question
    clock[0] += commands.OPEN - 0.1
    assert sending.question is run
    clock[0] += 0.2
    with pytest.raises(UserError, match=commands.TOO_LATE):
        sending.yes()
    sending.ask(run)
    sending.no()
    with pytest.raises(UserError, match=commands.TOO_LATE):
        sending.yes()
    assert not sending.on and sending.words == ''


def test_a_run_that_cannot_be_played_says_why(sending):
    sending.yes()
    assert sending.on and sending.question is None and 'playing "steps"' in sending.words
    until(lambda: not sending.on)
    assert '"steps" was not played to its end: ' in sending.words
    assert 'none.csv' in sending.words and 'leo: error' not in sending.words
    with pytest.raises(UserError, match=commands.TOO_LATE):
        sending.yes()


def test_it_is_stopped_while_it_starts(sending):
    sending.yes()
    sending.wait()
    assert not sending.on and 'goes to 0 by its own time-out' in sending.words


def test_a_robot_that_is_stopped_or_silent_gets_no_run(sending):
    robot = SimpleNamespace(
        condition=SimpleNamespace(e_stopped=True, trouble=''),
        buffer=SimpleNamespace(last_state=time.monotonic(), messages=0),
    )
    renewing = SimpleNamespace(look=lambda _: None, news=SimpleNamespace(trouble=''))
    live = Live(robot, None, renewing, sending)
    live.send()
    assert live.said == STOPPED
    robot.condition.e_stopped, robot.buffer.last_state = False, time.monotonic() - 60.0
    live.send()
    assert live.said == SILENT
    assert sending.question is not None and not sending.on
    robot.condition.e_stopped = True
    live.look()
    assert sending.question is None


def test_without_a_folder_nothing_can_be_recorded():
    switch = commands.RecordingSwitch(None)
    assert not switch.possible and switch.words == commands.NOWHERE
    with pytest.raises(UserError, match='-o DIR'):
        switch.start()
    switch.wait()


def test_before_the_first_recording_there_is_no_folder(tmp_path):
    switch = commands.RecordingSwitch(tmp_path / 'out')
    assert switch.possible and not switch.on and not switch.size
    assert switch.words == 'nothing is recorded' and not (tmp_path / 'out').exists()


def test_the_page_has_asked_so_play_need_not(monkeypatch):
    given = []
    monkeypatch.setattr(commands.Sending, '_run', lambda self, words, output: given.extend(words))
    sending = commands.Sending()
    sending.ask(commands.Sent(('play', 'run.csv'), 'steps', 2.0))
    sending.yes()
    assert given == ['play', 'run.csv', '--yes']
