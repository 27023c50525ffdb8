# SPDX-License-Identifier: Apache-2.0
"""How the robot is, in one line for the page."""

from __future__ import annotations

from dataclasses import dataclass
import time

from leo_diffmodel.bags.recorder import TWO
from leo_diffmodel.watch.live.tape import Tape

SILENT = 1.5
"""A robot from which no state comes for so long has ended, or waits [s]."""
GONE = (
    'no state from the robot for {:.0f} s: it ended, waits for a command, or cannot be reached. '
    'What was measured stays; the page goes on when it comes back'
)


@dataclass
class Condition:
    """What the robot says of itself.

    Attributes:
        e_stopped: as latched; None where it says nothing.
        message: its own line on /diagnostics: running, timed out, e-stop.
        level: of that line, 0 where all is well.
        said: monotonic time of that line [s].
        trouble: why the newest data are not shown; '' where they are.
    """

    e_stopped: bool | None = None
    message: str = ''
    level: int = 0
    said: float = 0.0
    trouble: str = ''

    def line(self, tape: Tape) -> tuple[bool, str]:
        """Whether all is well, and what to say."""
        if is_silent(tape):
            return False, GONE.format(_quiet(tape))
        if tape.two:
            return False, TWO.replace('recorded', 'shown')
        if self.trouble:
            return False, self.trouble
        if self.e_stopped:
            return False, self.message or 'e-stop'
        return not self.level, self.message or 'running'


def is_silent(tape: Tape) -> bool:
    """Whether no state comes from the robot."""
    return _quiet(tape) > SILENT


def _quiet(tape: Tape) -> float:
    """Since the last state [s]."""
    return time.monotonic() - tape.heard if tape.heard else 0.0
