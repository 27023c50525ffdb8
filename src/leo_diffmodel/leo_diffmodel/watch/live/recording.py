# SPDX-License-Identifier: Apache-2.0
"""Recording on and off: `leo bag record` in a process of its own, into a folder that is given."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

from leo_diffmodel.bags.recorder import free_folder
from leo_diffmodel.watch.live.command import Command
from leo_msgs_py.errors import UserError
from leo_msgs_py.terminal import leo

NOWHERE = 'start leo watch with -o DIR to record there'
STARTING = 'the recorder is starting'


class RecordingSwitch:
    """Starts and ends a recorder, which goes on whatever this process computes.

    Attributes:
        bag: the folder of the last recording; None before the first.
    """

    def __init__(self, folder: Path | None, ros_args: Sequence[str] = ()) -> None:
        self._folder, self._ros_args = folder, [*ros_args]
        self._recorder = Command()
        self.bag: Path | None = None

    @property
    def possible(self) -> bool:
        """Whether there is a folder to record into."""
        return self._folder is not None

    @property
    def on(self) -> bool:
        """Whether it records."""
        return self._recorder.on

    @property
    def size(self) -> int:
        """Bytes on disk of the last recording."""
        return sum(f.stat().st_size for f in self.bag.glob('*.mcap')) if self.bag else 0

    @property
    def words(self) -> str:
        """What it is doing, or how the last recording ended."""
        if not self.possible:
            return NOWHERE
        if self.bag is None:
            return 'nothing is recorded'
        if self.on:
            size = self.size
            return f'recording {self.bag}: {size / 1e6:.2f} MB' if size else STARTING
        ended = self._recorder.ended
        failed = f'the recorder of {self.bag} ended with {ended}: {leo("bag", "info", self.bag)}'
        return failed if ended else f'recorded {self.bag}'

    def start(self) -> None:
        """Begin a bag of its own, unless one is being recorded.

        Raises:
            UserError: there is no folder.
        """
        if self._folder is None:
            raise UserError(NOWHERE)
        if self.on:
            return
        self._folder.mkdir(parents=True, exist_ok=True)
        self.bag = free_folder(self._folder / 'run')
        self._recorder.start(['bag', 'record', '-o', str(self.bag), *self._ros_args])

    def stop(self) -> None:
        """Have the recorder finish its bag."""
        self._recorder.stop()

    def wait(self) -> None:
        """End the recorder and wait until its bag is whole."""
        self._recorder.wait()
