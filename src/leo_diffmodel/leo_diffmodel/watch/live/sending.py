# SPDX-License-Identifier: Apache-2.0
"""A run that is sent to the robot: asked twice, then `leo play` in a process of its own."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from tempfile import TemporaryFile
import time
from typing import IO

from leo_diffmodel.watch.live.command import Command
from leo_msgs_py.errors import UserError

OPEN = 15.0
"""How long a question waits for its answer [s]."""
TOO_LATE = 'the question has expired: nothing was sent; ask again'


@dataclass(frozen=True)
class Sent:
    """A run on its way.

    Attributes:
        words: after `leo`.
        name: of the run.
        seconds: how long it is [s].
    """

    words: tuple[str, ...]
    name: str
    seconds: float


class Sending:
    """One for all tabs.

    Args:
        ros_args: `--ros-args ...` of the player.
        now: a clock that goes on [s].
    """

    def __init__(
        self, ros_args: Sequence[str] = (), now: Callable[[], float] = time.monotonic
    ) -> None:
        self._ros_args, self._now = [*ros_args], now
        self._player = Command()
        self._question: Sent | None = None
        self._sent: Sent | None = None
        self._expires = self._began = 0.0
        self._stopped = False
        self._told: IO | None = None

    @property
    def question(self) -> Sent | None:
        """What waits for a confirmation; None where nothing does, or no more."""
        return self._question if self._now() < self._expires else None

    @property
    def on(self) -> bool:
        """Whether a run is being played."""
        return self._player.on

    @property
    def words(self) -> str:
        """What the player is doing, or how it ended; '' before the first."""
        sent, ended = self._sent, self._player.ended
        if sent is None:
            return ''
        if self.on:
            return (
                f'playing "{sent.name}" for {self._now() - self._began:.0f} s, '
                f'it takes {sent.seconds:.0f} s'
            )
        if self._stopped:
            return f'"{sent.name}" was stopped: the robot goes to 0 by its own time-out'
        if not ended:
            return f'"{sent.name}" was played to its end'
        return f'"{sent.name}" was not played to its end: {self._last()}'

    def ask(self, run: Sent) -> None:
        """Ask whether it is meant."""
        if not self.on:
            self._question, self._expires = run, self._now() + OPEN

    def no(self) -> None:
        """It was not meant."""
        self._question = None

    def yes(self) -> None:
        """Send it.

        Raises:
            UserError: nobody asked, or too long ago.
        """
        run, self._question = self.question, None
        if self.on:
            return
        if run is None:
            raise UserError(TOO_LATE)
        self._told = TemporaryFile('w+', encoding='utf-8', errors='replace')  # noqa: SIM115
        self._sent, self._began, self._stopped = run, self._now(), False
        self._player.start([*run.words, *self._ros_args], self._told)

    def stop(self) -> None:
        """Have the player end; the robot goes to 0 by its own time-out."""
        self._question = None
        if self.on:
            self._stopped = True
            self._player.stop()

    def wait(self) -> None:
        """End the player, and wait for that."""
        self.stop()
        self._player.wait()

    def _last(self) -> str:
        """The last line that the player printed: why it ended."""
        assert self._told is not None
        self._told.seek(0)
        lines = [line.strip() for line in self._told if line.strip()]
        return lines[-1].removeprefix('leo: error: ') if lines else 'the player said nothing'
