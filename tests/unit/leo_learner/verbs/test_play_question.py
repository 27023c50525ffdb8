# SPDX-License-Identifier: Apache-2.0
"""Nothing is sent that nobody agreed to."""

from dataclasses import replace
import os
import sys
from types import SimpleNamespace

import numpy as np
import pytest

from leo_diffmodel.next_run.dry_run import dry_run
from leo_diffmodel.next_run.run_file import Run
from leo_learner.verbs.play_question import agree, away, moved, see_that_somebody_answers, unturned
from leo_msgs_py.errors import UserError
from leo_sim.description.robot import load_robot
from leo_sim.model import Model
from leo_sim.model.state import State

PENDULUM, SERVO = load_robot('pendulum'), load_robot('xl330_pendulum')
CALM = dry_run(Run('r', '', np.zeros((10, 1)), np.ones(10, bool)), Model(PENDULUM))
WILD = replace(CALM, hits=('pivot runs into its stop at 0.3 s',))


@pytest.fixture
def keyboard(monkeypatch):
    ours, theirs = os.openpty()
    with os.fdopen(theirs) as stdin:
        monkeypatch.setattr(sys, 'stdin', stdin)
        yield lambda text: os.write(ours, text.encode())
    os.close(ours)


def options(yes: bool = False) -> SimpleNamespace:
    return SimpleNamespace(yes=yes, json=False, policy='run.csv')


def asked(found, yes=False, wait=lambda: None) -> bool:
    return agree(found, PENDULUM, [], options(yes), wait)


def test_only_a_yes_is_one(keyboard, capsys):
    for typed, sent in (('y\n', True), ('YES\n', True), ('n\n', False), ('\n', False)):
        keyboard(typed)
        assert asked(CALM) is sent
    said = capsys.readouterr()
    assert 'Send it? [y/N]' in said.err and 'pivot' in said.out and '0.5 s' in said.out


def test_yes_beforehand_is_no_answer_to_a_run_into_a_stop(keyboard, capsys):
    assert asked(CALM, yes=True)
    assert '[y/N]' not in capsys.readouterr().err
    keyboard('n\n')
    assert not asked(WILD, yes=True)
    said = capsys.readouterr()
    assert 'Send it all the same?' in said.err and 'pivot runs into its stop' in said.out


def test_ctrl_c_at_the_question_sends_nothing(keyboard, capsys):
    def interrupted():
        raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        asked(CALM, wait=interrupted)
    assert 'nothing was sent' in capsys.readouterr().err


def test_where_nobody_can_be_asked_it_is_one_line(monkeypatch):
    with open(os.devnull) as nobody:
        monkeypatch.setattr(sys, 'stdin', nobody)
        see_that_somebody_answers(options(yes=True))
        with pytest.raises(UserError, match=r'run.csv was not sent: .* give --yes'):
            see_that_somebody_answers(options())
        with pytest.raises(UserError, match='not sent: pivot runs into its stop'):
            asked(WILD, yes=True)
    with pytest.raises(UserError, match='no finite motion'):
        asked(replace(CALM, finite=False), yes=True)


def test_a_motor_begins_in_its_pose_and_servos_where_they_were_when_asked():
    here, there = (State(np.array([q]), np.zeros(1)) for q in (0.0, 0.4))
    assert 'pivot is 2.74 rad away' in away(PENDULUM, 'nominal', there)[0]
    assert away(PENDULUM, 'random', there) == [] == away(SERVO, 'nominal', there)
    spun = State(np.array([0.4 + 40 * np.pi]), np.zeros(1))
    assert unturned(PENDULUM, 'nominal', spun).q == pytest.approx(0.4)
    assert unturned(SERVO, 'nominal', spun) is spun
    assert moved(SERVO, here, there) and not moved(SERVO, here, here)
    assert not moved(PENDULUM, here, there)
