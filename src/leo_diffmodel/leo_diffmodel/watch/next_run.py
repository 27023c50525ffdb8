# SPDX-License-Identifier: Apache-2.0
"""What to record next: leo next on what 'find it for me' explained, in a process of its own."""

from collections.abc import Callable
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import Any

from leo_diffmodel.bags.recorder import free_folder
from leo_diffmodel.bags.recording import Recording
from leo_diffmodel.next_run.menu import MotionRun
from leo_diffmodel.next_run.run_file import Run, write_run
from leo_diffmodel.watch.setting import Answer, fresh
from leo_diffmodel.watch.state import State
from leo_diffmodel.watch.worker import Finder
from leo_msgs_py.errors import UserError
from leo_sim.common.worker import Report, Worker
from leo_sim.description.robot import Robot

NAME = 'next_run.csv'
FIRST = "'Find it for me' comes first: the run parts what that leaves open"
NOWHERE = 'start leo watch with -o DIR to write the run there'
GONE = f'the data that were searched are not kept; {NOWHERE}'


@dataclass(frozen=True)
class Plan:
    """What leo next says in sentences, and the run that it proposes, if any."""

    words: tuple[str, ...]
    robot: Robot
    run: Run | MotionRun | None = None
    predicted: Recording | None = None  # what the model with what was named makes of the run
    predict: tuple[str, ...] = ()  # options by which `leo play` predicts it, by the model as given

    @property
    def seconds(self) -> float:
        if isinstance(self.run, Run):
            return self.run.count * self.robot.control_period
        return self.run.seconds if self.run else 0.0

    def write(self, folder: Path) -> Path | None:
        """Write the run as a new file; None where it is none. OSError: it cannot be written."""
        if not isinstance(self.run, Run):
            return None
        folder.mkdir(parents=True, exist_ok=True)
        (file,) = fresh(folder, NAME)
        return write_run(file, self.run, self.robot)

    def command(self, file: Path | None) -> list[str]:
        """The words after `leo` that send it to the robot; none where there is nothing to send."""
        if isinstance(self.run, MotionRun):
            return self.run.command.split()
        return ['play', str(file), *self.predict] if file else []


Asked = Callable[[list[str], dict[str, Any], Report], Plan]
"""Proposes a run for the bags of a command line and the contents of their explain.json."""


class NextRun(Worker):
    """The run to record next; written to `file` as soon as it is known, if there is a folder."""

    def __init__(self, state: State, finder: Finder, asked: Asked) -> None:
        super().__init__()
        self._state, self._finder, self._asked = state, finder, asked
        self._about: Answer | None = None
        self.file: Path | None = None
        self._unwritten = ''

    @property
    def plan(self) -> Plan | None:
        return self.news.answer if self._about is self._state.answer else None

    @property
    def hindrance(self) -> str:
        if self._state.answer is None or self._finder.busy or self._finder.news.error:
            return FIRST
        return '' if self._finder.words else GONE

    @property
    def words(self) -> list[str]:
        return self.plan.command(self.file) if self.plan else []

    @property
    def recorded(self) -> list[str]:
        """As `words`, and recorded into a new bag next to the run."""
        if not self.words or self._state.folder is None:
            return self.words
        name = self.file.stem if self.file else self.words[1]
        return [*self.words, '--bag', str(free_folder(self._state.folder / name))]

    @property
    def said(self) -> str:
        return self._unwritten if self.plan else ''

    def start(self) -> None:
        answer = self._state.answer
        if answer is None or self.hindrance or self.busy:
            return
        self._about, self.file, self._unwritten = answer, None, ''
        self.begin(partial(self._asked, self._finder.words, answer.data))

    def look(self) -> None:
        if not self.poll():
            return
        if self.news.answer is not None:
            self._write(self.news.answer)
        self._state.notify()

    def _write(self, plan: Plan) -> None:
        folder = self._state.folder
        try:
            self.file = plan.write(folder) if folder else None
        except (UserError, OSError) as error:
            self._unwritten = str(error)
        if folder is None and plan.run is not None:
            self._unwritten = NOWHERE
