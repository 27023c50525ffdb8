# SPDX-License-Identifier: Apache-2.0
"""One line on how the robot is."""

from types import SimpleNamespace

from leo_diffmodel.watch.live import tape as module
from leo_diffmodel.watch.live.tape import Condition, SILENT, Tape


def test_silence_comes_before_all_else_and_then_what_the_robot_says(monkeypatch):
    now = 100.0
    monkeypatch.setattr(module, 'time', SimpleNamespace(monotonic=lambda: now))
    tape, condition = Tape(10.0), Condition(e_stopped=True, message='e-stop: 0 V', level=2)
    tape.heard = now
    assert condition.line(tape) == (False, 'e-stop: 0 V')
    tape.heard -= SILENT + 1.5
    well, text = condition.line(tape)
    assert not well and 'no state from the robot for 3 s' in text
    tape.heard = now
    assert Condition(message='running').line(tape) == (True, 'running')
    assert Condition(trouble='not shown: x').line(tape) == (False, 'not shown: x')
