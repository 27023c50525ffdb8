# SPDX-License-Identifier: Apache-2.0
"""The menu of runs to choose from: each shows some effects well, all stay within safe levels."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np

from leo_diffmodel.compare.windows import Array
from leo_diffmodel.next_run.reach import Reach
from leo_diffmodel.next_run.run_file import Run
from leo_diffmodel.next_run.settings import NEXT
from leo_msgs_py.errors import UserError
from leo_sim.description.robot import Robot
from leo_sim.task.motions import check_motion, MOTIONS

Shape = Callable[[Array, np.random.Generator], Array]
Draw = Callable[[np.random.Generator, int], Array]
SEED = 0
KICK_SECONDS, SWING_SECONDS = 1.5, 2.5
SEEDS = (11, 12, 13)  # of the figures of each motion; others than those a user takes first


def menu(robot: Robot, reach: Reach, seconds: float) -> list[Run]:
    """Runs of `seconds` for one robot, whose inputs go as far as `reach` says."""
    course = _Course(robot, reach, seconds)
    runs = [course.run(name, about, course.shaped(shape, s)) for name, about, shape, s in SHAPES]
    about = f'random steps for {KICK_SECONDS} s, then motors off for {SWING_SECONDS} s, and again'
    enabled = course.time % (KICK_SECONDS + SWING_SECONDS) < KICK_SECONDS
    runs.append(course.run('kick and let go', about, course.shaped(steps(0.3)), enabled))
    if len(robot.actuators) > 1:
        runs.append(_in_turn(course))
    return runs


class _Course:
    """What the runs of a menu have in common: times, what they go around, and how far, (A,)."""

    def __init__(self, robot: Robot, reach: Reach, seconds: float) -> None:
        period = robot.control_period
        count = max(1, round(seconds / period))
        lead = reach.lead(robot)
        self.time = np.arange(max(1, count - len(lead))) * period  # since the lead-in [s], (N,)
        # the inputs that a run goes around, lead-in first, (L + N, A)
        self.around = np.vstack([lead, np.tile(reach.centre, (len(self.time), 1))])
        self.size = reach.size

    def shaped(self, shape: Shape, share: float = 1.0) -> Array:
        """A shape drawn for every actuator, to a share of the size, (N, A)."""
        drawn = [shape(self.time, np.random.default_rng([SEED, a])) for a in range(len(self.size))]
        return share * np.stack(drawn, axis=-1) if drawn else np.zeros((len(self.time), 0))

    def run(self, name: str, about: str, signals: Array, enabled: Array | None = None) -> Run:
        """A run of signals (N, A) in shares of the size, with motors on as said, (N,)."""
        lead = len(self.around) - len(self.time)
        whole = np.vstack([np.zeros((lead, len(self.size))), signals])
        on = np.ones(len(whole), dtype=bool)
        if enabled is not None:
            on[lead:] = enabled
            whole = whole * on[:, None]
        return Run(name, about, self.around + self.size * whole, on, around=self.around)


def held(hold: float, draw: Draw) -> Shape:
    """Values drawn at random, each held for `hold` s."""

    def shape(time: Array, rng: np.random.Generator) -> Array:
        index = np.floor(time / hold + 1e-9).astype(int)
        return np.asarray(draw(rng, index[-1] + 1)[index])

    return shape


def steps(hold: float) -> Shape:
    return held(hold, lambda rng, n: rng.uniform(-1, 1, n))


def _in_turn(course: _Course) -> Run:
    about = 'random steps on one motor, the others at rest, in turn'
    count, time = len(course.size), course.time
    turn = np.floor(count * time / (time[-1] + 1e-9)).astype(int)
    moves = turn[:, None] == np.arange(count)
    return course.run('one joint at a time', about, moves * course.shaped(steps(0.3)))


def _triangle(period: float) -> Shape:
    return lambda time, rng: 2 / np.pi * np.arcsin(np.sin(2 * np.pi * time / period))


def _sines(low: float, high: float) -> Shape:
    """Five sines of random frequency and phase between `low` and `high` Hz."""

    def shape(time: Array, rng: np.random.Generator) -> Array:
        waves = [
            np.sin(2 * np.pi * f * time + rng.uniform(0, 6))
            for f in np.exp(rng.uniform(np.log(low), np.log(high), 5))
        ]
        total = np.sum(waves, axis=0)
        return np.asarray(total / np.abs(total).max())

    return shape


def _chirp(time: Array, rng: np.random.Generator) -> Array:
    low, high = 0.1, 4.0
    return np.sin(2 * np.pi * (low * time + 0.5 * (high - low) / max(time[-1], 1.0) * time**2))


def _flicker(time: Array, rng: np.random.Generator) -> Array:
    index = np.arange(len(time)) // 2
    return rng.choice([-1.0, 1.0], index[-1] + 1)[index]


def _one_way(time: Array, rng: np.random.Generator) -> Array:
    sign = np.where(time < 0.5 * time[-1], 1.0, -1.0)
    return sign * held(0.5, lambda rng, n: rng.uniform(0.2, 1, n))(time, rng)


def _pulses(time: Array, rng: np.random.Generator) -> Array:
    sizes = held(0.8, lambda rng, n: rng.uniform(0.5, 1, n) * rng.choice([-1, 1], n))
    over = time % 0.8 >= 0.1 - 1e-9  # 0 V brakes, a servo goes back
    return np.where(over, 0.0, sizes(time, rng))


_binary = held(0.4, lambda rng, n: np.sign(rng.uniform(-1, 1, n)))
_stairs = held(2.0, lambda rng, n: rng.permutation(np.linspace(-1, 1, n)))
SHAPES: tuple[tuple[str, str, Shape, float], ...] = (
    ('steps, large', 'random steps of 0.3 s, to the full level', steps(0.3), 1.0),
    ('steps, half', 'random steps of 0.3 s, to half of the level', steps(0.3), 0.5),
    ('steps, small', 'random steps of 0.3 s, to a fifth of the level', steps(0.3), 0.2),
    ('steps, long', 'random steps of 1 s, to the full level', steps(1.0), 1.0),
    ('binary', 'full level one way or the other, random, held for 0.4 s', _binary, 1.0),
    ('triangle, slow', 'triangle of 8 s: slow motion through every angle', _triangle(8.0), 1.0),
    ('triangle, fast', 'triangle of 1.5 s', _triangle(1.5), 1.0),
    ('flicker', 'full level one way or the other, drawn every second period', _flicker, 1.0),
    ('sines', 'five sines of 0.2 to 5 Hz', _sines(0.2, 5), 1.0),
    ('sines, small', 'five sines of 0.2 to 5 Hz, to a third of the level', _sines(0.2, 5), 0.33),
    ('sines, fast', 'five sines of 2 to 8 Hz', _sines(2, 8), 1.0),
    ('chirp', 'one sine from 0.1 to 4 Hz', _chirp, 1.0),
    ('stairs', 'constant inputs of 2 s: rest in several poses', _stairs, 1.0),
    ('one way', 'steps of one sign, then of the other', _one_way, 1.0),
    ('pulses', 'pulses of 0.1 s with 0.7 s at rest between', _pulses, 1.0),
)


@dataclass(frozen=True)
class MotionRun:
    """A scripted motion to be recorded for some seconds; `seed` is that of its figures."""

    motion: str
    seed: int
    seconds: float

    @property
    def name(self) -> str:
        return f'{self.motion}, seed {self.seed}'

    @property
    def about(self) -> str:
        return f'{MOTIONS[self.motion].about}, from the pose {MOTIONS[self.motion].start!r}'

    @property
    def times(self) -> float:
        return max(1.0, self.seconds / NEXT.tried_seconds)

    @property
    def command(self) -> str:
        return f'play {self.motion} --seed {self.seed} --seconds {self.seconds:g}'


Runs = Sequence[Run | MotionRun]


def walker_menu(robot: Robot, reach: Reach, seconds: float) -> list[Run | MotionRun]:
    """Runs of `seconds` for a robot with a floating base: none of them makes it fall at once.

    `reach` says how far the inputs go where the base is held.
    """
    hung = [
        replace(run, name=f'{pose}: {run.name}', start=pose)
        for pose, is_held in ((n, p.held) for n, p in robot.start_poses.items())
        if is_held
        for run in menu(robot, reach.beginning(robot, pose), seconds)
    ]
    motions = [MotionRun(m, s, seconds) for m in MOTIONS if _can(robot, m) for s in SEEDS]
    return [*hung, *motions]


def _can(robot: Robot, motion: str) -> bool:
    try:
        check_motion(robot, motion)
    except UserError:
        return False
    return True
