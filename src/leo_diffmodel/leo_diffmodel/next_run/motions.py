# SPDX-License-Identifier: Apache-2.0
"""What a walker can do next: open-loop runs where its base is held, scripted motions else."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from leo_diffmodel.bags.recording import Episode
from leo_diffmodel.next_run.menu import menu
from leo_diffmodel.next_run.proposed_run import Run
from leo_msgs_py.errors import UserError
from leo_sim.description.robot import Robot
from leo_sim.model import Model
from leo_sim.task.motions import check_motion, MOTIONS, Routine

Array = np.ndarray
SEEDS = (11, 12, 13)
"""Of the figures of each motion; others than those a user takes first."""
TRIED_SECONDS = 6.0
"""A motion is simulated so long, and its evidence grown to its length."""


@dataclass(frozen=True)
class MotionRun:
    """A scripted motion to be recorded.

    Attributes:
        motion: of `MOTIONS`.
        seed: of its figures.
        seconds: how long [s].
    """

    motion: str
    seed: int
    seconds: float

    @property
    def name(self) -> str:
        """Short, for tables."""
        return f'{self.motion}, seed {self.seed}'

    @property
    def about(self) -> str:
        """What it does, in words."""
        return f'{MOTIONS[self.motion].about}, from the pose {MOTIONS[self.motion].start!r}'

    @property
    def times(self) -> float:
        """How many times as long it is as what is simulated of it."""
        return max(1.0, self.seconds / TRIED_SECONDS)

    @property
    def command(self) -> str:
        """The words after `leo` that perform it."""
        return f'play {self.motion} --seed {self.seed} --seconds {self.seconds:g}'


def walker_menu(robot: Robot, levels: Array, seconds: float) -> list[Run | MotionRun]:
    """Every run for a robot on the ground: none of them makes it fall at once.

    Args:
        robot: with a floating base.
        levels: largest input to use on each actuator where the base is held, shape (A,).
        seconds: length of each run.
    """
    hung = [
        replace(run, name=f'{pose}: {run.name}', start=pose)
        for pose, is_held in ((n, p.held) for n, p in robot.start_poses.items())
        if is_held
        for run in menu(robot, levels, seconds)
    ]
    motions = [MotionRun(m, s, seconds) for m in MOTIONS if _can(robot, m) for s in SEEDS]
    return [*hung, *motions]


def _can(robot: Robot, motion: str) -> bool:
    try:
        check_motion(robot, motion)
    except UserError:
        return False
    return True


def performed(run: MotionRun, model: Model, period: float) -> tuple[Episode, ...]:
    """The motion as a model performs it, without noise, states every `period` s."""
    robot, rng = model.robot, np.random.default_rng(run.seed)
    repeat = max(1, round(robot.control_period / period))
    dt = robot.control_period / repeat
    routine, track = Routine(robot, run.motion, run.seed), _Track(dt)
    state = model.start(routine.start, rng)
    for _ in range(round(min(run.seconds, TRIED_SECONDS) / robot.control_period)):
        volts = routine.volts(*model.sense(state))
        if volts is None:
            track.cut()
            state = model.start(routine.start, rng, track.seconds)
            continue
        for _ in range(repeat):
            track.add(*model.sense(state), volts)
            state = model.step(state, volts, dt)
    track.cut()
    return tuple(track.episodes)


class _Track:
    """Episodes as they grow."""

    def __init__(self, dt: float) -> None:
        self.episodes: list[Episode] = []
        self._rows: list[tuple[Array, ...]] = []
        self._dt, self._count = dt, 0

    @property
    def seconds(self) -> float:
        """Since the run began, at the last cut."""
        return self._dt * self._count

    def add(self, *row: Array) -> None:
        """Angles, rates and inputs held from then on."""
        self._rows.append(row)

    def cut(self) -> None:
        """The robot is put up again, or done."""
        if len(self._rows) > 1:
            q, dq, inputs = (np.array(column) for column in zip(*self._rows, strict=True))
            t = self._dt * (self._count + np.arange(len(q), dtype=np.float64))
            self.episodes.append(Episode(t, q, dq, inputs, np.ones(inputs.shape, dtype=bool)))
        self._count += len(self._rows) + 1
        self._rows = []
