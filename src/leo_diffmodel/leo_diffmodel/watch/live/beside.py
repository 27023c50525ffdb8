# SPDX-License-Identifier: Apache-2.0
"""All that stands beside the page while a robot runs: robot, recorder, player, computing."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Protocol

from leo_diffmodel.watch.live.condition import Condition, is_silent
from leo_diffmodel.watch.live.recording import RecordingSwitch
from leo_diffmodel.watch.live.renewing import Renewing
from leo_diffmodel.watch.live.sending import Sending
from leo_diffmodel.watch.live.tape import Tape
from leo_msgs_py.errors import UserError

STOPPED = 'The e-stop is latched: release it before a run is sent.'
SILENT = 'no state comes from the robot: nothing was sent'
NO_SHARE = 'no difference model publishes its weights'


class Robot(Protocol):
    """The running robot, as far as the page has to do with it."""

    tape: Tape
    condition: Condition
    asked: str

    def e_stop(self) -> None:
        """Stop it."""

    def release(self) -> None:
        """Take the e-stop back."""


@dataclass(frozen=True)
class Lines:
    """What the page says: whether all is well, how the robot is, and more, a line each."""

    well: bool
    robot: str
    more: tuple[str, ...]


@dataclass
class Beside:
    """One for all tabs.

    Attributes:
        said: what went wrong with a button; '' where nothing did.
    """

    robot: Robot
    recording: RecordingSwitch
    renewing: Renewing
    sending: Sending = field(default_factory=Sending)
    said: str = ''

    def look(self) -> None:
        """Take in what is new; an e-stop, whoever asked for it, ends a run that is sent."""
        self.renewing.look(self.robot.tape.messages)
        self.robot.condition.trouble = self.renewing.news.trouble
        if self.robot.condition.e_stopped:
            self.sending.stop()

    def switch_recording(self) -> None:
        """Recording on or off.

        Raises:
            UserError: there is nowhere to record to.
        """
        self.said = ''
        if self.recording.on:
            self.recording.stop()
        else:
            self.recording.start()

    def send(self) -> None:
        """Send the run that was asked about.

        Raises:
            UserError: the robot is stopped or silent, or the question has expired.
        """
        self.said = ''
        if self.robot.condition.e_stopped:
            raise UserError(STOPPED)
        if is_silent(self.robot.tape):
            raise UserError(SILENT)
        self.sending.yes()

    def lines(self) -> Lines:
        """What to say now."""
        well, robot = self.robot.condition.line(self.robot.tape)
        news = self.renewing.news
        held = 'the data are held as they were' if self.renewing.frozen else news.words
        more = (
            self.robot.asked,
            self.said,
            held,
            self.sending.words,
            self.recording.words,
            news.share.words if news.share else NO_SHARE,
        )
        return Lines(well, robot, tuple(text for text in more if text))
