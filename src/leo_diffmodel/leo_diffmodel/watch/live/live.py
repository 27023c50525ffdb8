# SPDX-License-Identifier: Apache-2.0
"""What the page has of a running robot: the robot, a recorder, a player, computing, a search."""

from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field
from pathlib import Path
import shutil
import tempfile
from typing import Protocol

from leo_diffmodel.bags.cut import write_contents
from leo_diffmodel.bags.recorder import free_folder
from leo_diffmodel.watch.live.buffer import Condition, is_silent, MessageBuffer
from leo_diffmodel.watch.live.commands import RecordingSwitch, Sending
from leo_diffmodel.watch.live.renewing import Renewing
from leo_diffmodel.watch.worker import Asked, Finder
from leo_msgs_py.errors import UserError
from leo_sim.common.worker import News

STOPPED = 'The e-stop is latched: release it before a run is sent.'
SILENT = 'no state comes from the robot: nothing was sent'
NO_SHARE = 'no difference model publishes its weights'
SEARCHED = 'searched'


class Robot(Protocol):
    buffer: MessageBuffer
    condition: Condition
    asked: str

    def e_stop(self) -> object: ...

    def release(self) -> None: ...


@dataclass
class Live:
    """One for all tabs; `said` is what went wrong with a button, '' where nothing did."""

    robot: Robot
    recording: RecordingSwitch
    renewing: Renewing
    sending: Sending = field(default_factory=Sending)
    said: str = ''
    e_stop_url: str = ''  # where a browser asks for it

    def look(self) -> None:
        """Take in what is new; an e-stop, whoever asked for it, ends a run that is sent."""
        self.renewing.look(self.robot.buffer.messages)
        self.robot.condition.trouble = self.renewing.news.trouble
        if self.robot.condition.e_stopped:
            self.sending.stop()

    def switch_recording(self) -> None:
        with self._saying():
            if self.recording.on:
                self.recording.stop()
            else:
                self.recording.start()

    def send(self) -> None:
        with self._saying():
            if self.robot.condition.e_stopped:
                raise UserError(STOPPED)
            if is_silent(self.robot.buffer):
                raise UserError(SILENT)
            self.sending.yes()

    @contextmanager
    def _saying(self) -> Iterator[None]:
        self.said = ''
        try:
            yield
        except (UserError, OSError) as error:
            self.said = str(error)

    def lines(self) -> tuple[bool, list[str]]:
        """Whether all is well, and what to say now: how the robot is, and more."""
        well, robot = self.robot.condition.line(self.robot.buffer)
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
        return well, [robot, *filter(None, more)]


class LiveFinder(Finder):
    """A search over the last seconds before it was asked for.

    Bags that were searched stay in the folder, as models name them; without one they are there
    only for the search.
    """

    def __init__(
        self, buffer: MessageBuffer, asked: Asked, words: list[str], folder: Path | None
    ) -> None:
        super().__init__(asked, words)
        self._buffer, self._model, self._folder = buffer, words, folder
        self._passing: Path | None = None

    def start(self) -> None:
        if self.busy:
            return
        try:
            bag = self._free()
            write_contents(self._buffer.contents(), bag)
        except (UserError, OSError) as error:
            self.news = News(error=str(error))
            return
        self.words = [str(bag), *self._model]
        super().start()

    def stop(self) -> None:
        """End the search, and forget what was saved only for it."""
        super().stop()
        if self._passing is not None:
            shutil.rmtree(self._passing, ignore_errors=True)
            self._passing, self.words = None, []

    def _free(self) -> Path:
        if self._folder is not None:
            return free_folder(self._folder / SEARCHED)
        self._passing = Path(tempfile.mkdtemp(prefix='leo_watch_'))
        return self._passing / SEARCHED
