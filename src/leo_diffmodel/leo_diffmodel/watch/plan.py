# SPDX-License-Identifier: Apache-2.0
"""The run that leo next proposes, as the page shows it."""

from __future__ import annotations

from dataclasses import dataclass
import itertools
from pathlib import Path

from leo_diffmodel.bags.recording import Recording
from leo_diffmodel.next_run.menu import MotionRun
from leo_diffmodel.next_run.run_file import Run, write_run
from leo_sim.description.robot import Robot

NAME = 'next_run'


@dataclass(frozen=True)
class Plan:
    """What leo next says.

    Attributes:
        words: in sentences.
        robot: whose it is.
        run: the run; None where none is proposed.
        predicted: what the model with what was named makes of it; None where there is no run.
    """

    words: tuple[str, ...]
    robot: Robot
    run: Run | MotionRun | None = None
    predicted: Recording | None = None

    @property
    def seconds(self) -> float:
        """How long the run is [s]."""
        if isinstance(self.run, Run):
            return self.run.count * self.robot.control_period
        return self.run.seconds if self.run else 0.0

    def write(self, folder: Path) -> Path | None:
        """Write the run file as a new one into a folder; None where the run is no file.

        Raises:
            OSError: it cannot be written.
        """
        if not isinstance(self.run, Run):
            return None
        folder.mkdir(parents=True, exist_ok=True)
        return write_run(_fresh(folder), self.run, self.robot)

    def command(self, file: Path | None) -> list[str]:
        """The words after `leo` that send it to the robot; none where there is nothing to send."""
        if isinstance(self.run, MotionRun):
            return self.run.command.split()
        return ['play', str(file)] if file else []


def _fresh(folder: Path) -> Path:
    """A run file that is not there yet."""
    names = (f'{NAME}_{n}.csv' if n > 1 else f'{NAME}.csv' for n in itertools.count(1))
    return next(folder / name for name in names if not (folder / name).exists())
