# SPDX-License-Identifier: Apache-2.0
"""`leo` commands in processes of their own: one that records, and one that plays a run."""

from collections.abc import Callable, Sequence
from contextlib import suppress
from dataclasses import dataclass
import os
from pathlib import Path
import subprocess
from tempfile import TemporaryFile
import time
from typing import IO

from leo_diffmodel.bags.recorder import free_folder
from leo_msgs_py.ending import PARENT
from leo_msgs_py.errors import UserError
from leo_msgs_py.terminal import leo, leo_process

GRACE = 10.0  # what a command may take to end [s]
NOWHERE = 'start leo watch with -o DIR to record there'
STARTING = 'the recorder is starting'
OPEN = 15.0  # how long a question waits for its answer [s]
YES = '--yes'  # the page has asked; `leo play` need not
TOO_LATE = 'the question has expired: nothing was sent; ask again'


class Command:
    """A command, which ends in its own way when it is asked to; `ros_args` are its last words."""

    def __init__(self, ros_args: Sequence[str] = ()) -> None:
        self._ros_args = [*ros_args]
        self._process: subprocess.Popen | None = None

    @property
    def on(self) -> bool:
        return self._process is not None and self._process.poll() is None

    @property
    def ended(self) -> int | None:
        """Its exit status; None before it was started and while it runs."""
        return self._process.poll() if self._process else None

    def stop(self) -> None:
        if self._process is not None:
            self._process.terminate()

    def wait(self) -> None:
        self.stop()
        if self._process is not None:
            with suppress(subprocess.TimeoutExpired):  # it goes on, and ends by itself
                self._process.wait(GRACE)

    def _run(self, words: Sequence[str], output: IO | None = None) -> None:
        """Start it; `output` takes what it prints; without one stderr alone is shown."""
        self._process = subprocess.Popen(
            leo_process(*words, *self._ros_args),
            env=os.environ | {PARENT: str(os.getpid())},
            stdin=subprocess.DEVNULL,
            stdout=output or subprocess.DEVNULL,
            stderr=output,
        )


class RecordingSwitch(Command):
    """`leo bag record` into a folder; `bag` is the last one, None before the first."""

    def __init__(self, folder: Path | None, ros_args: Sequence[str] = ()) -> None:
        super().__init__(ros_args)
        self._folder = folder
        self.bag: Path | None = None

    @property
    def possible(self) -> bool:
        return self._folder is not None

    @property
    def size(self) -> int:
        return sum(f.stat().st_size for f in self.bag.glob('*.mcap')) if self.bag else 0

    @property
    def words(self) -> str:
        if not self.possible:
            return NOWHERE
        if self.bag is None:
            return 'nothing is recorded'
        if self.on:
            size = self.size
            return f'recording {self.bag}: {size / 1e6:.2f} MB' if size else STARTING
        if self.ended:
            info = leo('bag', 'info', self.bag)
            return f'the recorder of {self.bag} ended with {self.ended}: {info}'
        return f'recorded {self.bag}'

    def start(self) -> None:
        if self._folder is None:
            raise UserError(NOWHERE)
        if self.on:
            return
        self._folder.mkdir(parents=True, exist_ok=True)
        self.bag = free_folder(self._folder / 'run')
        self._run(['bag', 'record', '-o', str(self.bag)])


@dataclass(frozen=True)
class Sent:
    """A run on its way: the words after `leo`, its name and length [s]."""

    words: tuple[str, ...]
    name: str
    seconds: float


class Sending(Command):
    """`leo play` of a run, after a question; one for all tabs. `now` is a clock [s]."""

    def __init__(
        self, ros_args: Sequence[str] = (), now: Callable[[], float] = time.monotonic
    ) -> None:
        super().__init__(ros_args)
        self._now = now
        self._question: Sent | None = None
        self._sent: Sent | None = None
        self._expires = self._began = 0.0
        self._stopped = False
        self._output: IO | None = None

    @property
    def question(self) -> Sent | None:
        """What waits for a confirmation; None where nothing does, or no more."""
        return self._question if self._now() < self._expires else None

    @property
    def words(self) -> str:
        """What the player is doing, or how it ended; '' before the first."""
        sent = self._sent
        if sent is None:
            return ''
        if self.on:
            elapsed = self._now() - self._began
            return f'playing "{sent.name}" for {elapsed:.0f} s, it takes {sent.seconds:.0f} s'
        if self._stopped:
            return f'"{sent.name}" was stopped: the robot goes to 0 by its own time-out'
        if not self.ended:
            return f'"{sent.name}" was played to its end'
        return f'"{sent.name}" was not played to its end: {self._last()}'

    def ask(self, run: Sent) -> None:
        if not self.on:
            self._question, self._expires = run, self._now() + OPEN

    def no(self) -> None:
        self._question = None

    def yes(self) -> None:
        run, self._question = self.question, None
        if self.on:
            return
        if run is None:
            raise UserError(TOO_LATE)
        self._output = TemporaryFile('w+', encoding='utf-8', errors='replace')  # noqa: SIM115
        self._sent, self._began, self._stopped = run, self._now(), False
        self._run([*run.words, YES], self._output)

    def stop(self) -> None:
        """Have the player end; the robot goes to 0 by its own time-out."""
        self._question = None
        if self.on:
            self._stopped = True
        super().stop()

    def _last(self) -> str:
        assert self._output is not None
        self._output.seek(0)
        lines = [line.strip() for line in self._output if line.strip()]
        return lines[-1].removeprefix('leo: error: ') if lines else 'the player said nothing'
