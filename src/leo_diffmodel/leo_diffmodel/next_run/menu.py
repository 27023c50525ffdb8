# SPDX-License-Identifier: Apache-2.0
"""The menu of runs to choose from: each shows some effects well, all stay within safe levels."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from leo_diffmodel.next_run.proposed_run import Run
from leo_sim.description.robot import Robot

Array = np.ndarray
Shape = Callable[[Array, np.random.Generator], Array]
SEED = 0
KICK_SECONDS, SWING_SECONDS = 1.5, 2.5


def menu(robot: Robot, levels: Array, seconds: float) -> list[Run]:
    """Every run for one robot.

    Args:
        robot: the robot.
        levels: largest input to use on each actuator [V, N m or rad], shape (A,).
        seconds: length of each run.
    """
    time = np.arange(max(1, round(seconds / robot.control_period))) * robot.control_period
    runs = [
        _powered(name, about, shape, time, share * levels) for name, about, shape, share in SHAPES
    ]
    runs.append(_let_go(time, levels))
    if len(levels) > 1:
        runs.append(_in_turn(time, levels))
    return runs


def steps(hold: float) -> Shape:
    """Steps of random size and sign, each held for `hold` s."""
    return lambda time, rng: _held(time, hold, lambda n: rng.uniform(-1, 1, n))


def _powered(name: str, about: str, shape: Shape, time: Array, levels: Array) -> Run:
    signals = [shape(time, np.random.default_rng([SEED, a])) for a in range(len(levels))]
    inputs = levels * np.stack(signals, axis=-1) if signals else np.zeros((len(time), 0))
    return Run(name, about, inputs, np.ones(len(time), dtype=bool))


def _let_go(time: Array, levels: Array) -> Run:
    """Kicks, after each of which the motors are off and the robot swings freely."""
    run = _powered(
        'kick and let go',
        f'random steps for {KICK_SECONDS} s, then motors off for {SWING_SECONDS} s, and again',
        steps(0.3),
        time,
        levels,
    )
    enabled = time % (KICK_SECONDS + SWING_SECONDS) < KICK_SECONDS
    return Run(run.name, run.about, run.inputs * enabled[:, None], enabled)


def _in_turn(time: Array, levels: Array) -> Run:
    """Random steps on one actuator at a time, the others at 0."""
    run = _powered(
        'one joint at a time',
        'random steps on one motor, the others at 0, in turn',
        steps(0.3),
        time,
        levels,
    )
    turn = np.floor(len(levels) * time / (time[-1] + 1e-9)).astype(int)
    mine = turn[:, None] == np.arange(len(levels))
    return Run(run.name, run.about, run.inputs * mine, run.enabled)


def _held(time: Array, hold: float, draw: Callable[[int], Array]) -> Array:
    index = np.floor(time / hold + 1e-9).astype(int)
    return np.asarray(draw(index[-1] + 1)[index])


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


def _binary(time: Array, rng: np.random.Generator) -> Array:
    return np.sign(_held(time, 0.4, lambda n: rng.uniform(-1, 1, n)))


def _flicker(time: Array, rng: np.random.Generator) -> Array:
    """Full level one way or the other, drawn anew every second control period."""
    index = np.arange(len(time)) // 2
    return rng.choice([-1.0, 1.0], index[-1] + 1)[index]


def _stairs(time: Array, rng: np.random.Generator) -> Array:
    """Constant inputs of 2 s that rest the robot in several poses, in random order."""
    return _held(time, 2.0, lambda n: rng.permutation(np.linspace(-1, 1, n)))


def _one_way(time: Array, rng: np.random.Generator) -> Array:
    """Steps of one sign for the first half, of the other for the second."""
    sign = np.where(time < 0.5 * time[-1], 1.0, -1.0)
    return sign * np.abs(_held(time, 0.5, lambda n: rng.uniform(0.2, 1, n)))


def _pulses(time: Array, rng: np.random.Generator) -> Array:
    """Pulses of 0.1 s, then 0.7 s at 0 (0 V brakes)."""
    sizes = _held(time, 0.8, lambda n: rng.uniform(0.5, 1, n) * rng.choice([-1, 1], n))
    return np.where(time % 0.8 < 0.1 - 1e-9, sizes, 0.0)


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
    ('pulses', 'pulses of 0.1 s with 0.7 s at 0 between', _pulses, 1.0),
)
