# SPDX-License-Identifier: Apache-2.0
"""One blind case: a robot, its noise and excitation, and what is wrong with it."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from leo_lab.blind import outside, pushes
from leo_lab.blind.drawn import Drawn, log_uniform, one_of, several, SIZES
from leo_lab.blind.excitation import excitation, SECONDS
from leo_lab.blind.open_loop import Run
from leo_lab.blind.pushes import Push
from leo_lab.blind.scenes import Effects, Given, Moving, Scene
from leo_lab.blind.sensing import PLAIN, Sensing
from leo_lab.blind.small import draw_small, NOT_IN_MUJOCO
from leo_sim.description.robot import load_robot, Robot

ROBOTS = ('pendulum', 'torque_pendulum', 'servo_pendulum', 'double_pendulum')
ENGINES = (('pybullet', 0.0), ('rk4', 0.0009))
WALKER_ENGINES = (('pybullet', 0.0), ('rigid', 2.6e-5))
MUJOCO = 'mujoco', 4e-5
"""It takes damping D implicitly, which with a step of h acts as an inertia of D h / 2 more: with
0.5 ms `leo explain` found that as `armature` at all joints of LEO. Its dry friction grows with h:
0.05 N m acts as 0.0512 with 1 ms, 0.05007 with 0.1 ms, 0.05003 with 0.04 ms."""
WALKER_SCENES = (('swinging', 6.0), ('standing', 4.0), ('stepping', 10.0))
"""What a walker does, and for how long [s]."""
PUSHED_SIZES = (5.0, 30.0)
STRENGTHS, LENGTHS = (0.1, 30.0), (10.0, 20.0, 40.0)
"""Noise floors, and seconds of data."""
POSITION_NOISE = (0.5e-3, 3e-3)
RATE_NOISE = (0.02, 0.1)


@dataclass(frozen=True)
class Case:
    """All that a case is; `run.robot` and `effects` are the truth.

    Attributes:
        kind: of `KINDS`.
        seed: of everything drawn.
        robot: the robot as everybody knows it.
        run: the robot with its true constants, its noise and what drives it.
        engine: physics engine of the robot and its integration step [s] (0: the robot's own).
        effects: what is hidden.
        sizes: of each, rms change of the noise-free 0.5 s open loop over the noise floor there.
        small: what else is wrong, each below one floor.
        small_sizes: of each.
        sensing: what is wrong with the measurement.
        pushes: what moves the robot besides its motors.
    """

    kind: str
    seed: int
    robot: Robot
    run: Run
    engine: tuple[str, float]
    effects: Effects = ()
    sizes: tuple[float, ...] = ()
    small: Effects = ()
    small_sizes: tuple[float, ...] = ()
    sensing: Sensing = PLAIN
    pushes: tuple[Push, ...] = ()


def draw_case(seed: int, kind: str, robot: str | Path | None = None) -> Case:
    """The case of a seed.

    Args:
        seed: of everything drawn.
        kind: of `KINDS`.
        robot: by name or folder; None takes those of `ROBOTS` in turn.
    """
    rng = np.random.default_rng([seed, tuple(KINDS).index(kind)])
    known = load_robot(robot or robot_name(seed))
    while True:
        noise = (log_uniform(rng, POSITION_NOISE), log_uniform(rng, RATE_NOISE))
        built = _as_built(known, rng)
        scenes = _motions(known, rng) if known.contacts else (Given(*excitation(known, rng)),)
        run = Run(built, scenes, noise)
        drawn = KINDS[kind](seed, run, rng)
        if drawn is not None:
            wrong = drawn._asdict()
            engine = engine_of(seed, bool(known.contacts), drawn.effects)
            return Case(kind, seed, known, wrong.pop('run') or run, engine, **wrong)


def robot_name(seed: int) -> str:
    """The robot of `ROBOTS` that is a seed's."""
    return ROBOTS[seed // 2 % len(ROBOTS)]


def engine_of(seed: int, walks: bool, effects: Effects = ()) -> tuple[str, float]:
    """What simulates a case: MuJoCo at odd seeds, our own engines in turn at even ones.

    No other integrator of ours knows the ground: a walker has another time step alone. What
    MuJoCo has no law for comes from another integrator or time step than the model's.
    """
    own, other = WALKER_ENGINES if walks else ENGINES
    if seed % 2:
        known = all(p.effect.name not in NOT_IN_MUJOCO for p in effects)
        return MUJOCO if known else other
    return other if seed // (2 * len(ROBOTS)) % 2 else own


def _motions(robot: Robot, rng: np.random.Generator) -> tuple[Scene, ...]:
    """What a walker does, each motion with figures of its own."""
    return tuple(
        Moving(robot, name, round(seconds / robot.control_period), int(rng.integers(2**31)))
        for name, seconds in WALKER_SCENES
    )


def _as_built(robot: Robot, rng: np.random.Generator) -> Robot:
    """The robot with uncertain constants that differ: in the middle half of their ranges."""
    changed = {}
    for path, constant in robot.constants.items():
        if constant.uncertain:
            low, high = constant.uncertain
            value = float(rng.uniform(0.75 * low + 0.25 * high, 0.25 * low + 0.75 * high))
            changed[path] = replace(constant, value=value)
    return robot.with_constants(changed)


def _nothing(seed: int, run: Run, rng: np.random.Generator) -> Drawn:
    return Drawn()


def _single(seed: int, run: Run, rng: np.random.Generator) -> Drawn:
    placed, size = one_of(run, (), SIZES, rng)
    return Drawn((placed,), (size,))


def _strength(seed: int, run: Run, rng: np.random.Generator) -> Drawn:
    """One effect, from weak to strong, in runs of each length on every robot in turn."""
    seconds = LENGTHS[seed // (2 * len(ROBOTS)) % len(LENGTHS)]
    run = replace(run, scenes=(Given(*excitation(run.robot, rng, seconds)),))
    placed, size = one_of(run, (), STRENGTHS, rng)
    return Drawn((placed,), (size,), run=run)


def _pair(seed: int, run: Run, rng: np.random.Generator) -> Drawn:
    return Drawn(*several(2, run, rng))


def _triple(seed: int, run: Run, rng: np.random.Generator) -> Drawn:
    return Drawn(*several(3, run, rng))


def _outside(seed: int, run: Run, rng: np.random.Generator) -> Drawn | None:
    """A law of no catalogue, each kind on every robot in turn; None in a run that hides it."""
    kind = outside.KINDS[seed // (2 * len(ROBOTS)) % len(outside.KINDS)]
    drawn = outside.draw(kind, run, rng)
    return drawn and Drawn((drawn[0],), (drawn[1],))


def _pushed(seed: int, run: Run, rng: np.random.Generator) -> Drawn:
    """Each way of pushing on every robot in turn; a third of them hide an effect."""
    turn = seed // (2 * len(ROBOTS))
    effects = (one_of(run, (), PUSHED_SIZES, rng),) if turn // len(pushes.KINDS) % 3 == 2 else ()
    kind = pushes.KINDS[turn % len(pushes.KINDS)]
    drawn = pushes.draw_pushes(kind, run.robot, SECONDS, rng)
    return Drawn(
        tuple(p for p, _ in effects),
        tuple(s for _, s in effects),
        pushes=drawn,
        run=_led(run, drawn, rng),
    )


def _led(run: Run, drawn: tuple[Push, ...], rng: np.random.Generator) -> Run:
    """The run with motors at 0, or free, while a hand leads a joint."""
    (scene,), free = run.scenes, bool(rng.integers(2))
    assert isinstance(scene, Given)
    time = np.arange(scene.count) * run.robot.control_period
    led = np.any(
        [(time >= p.begin) & (time < p.begin + p.seconds) for p in drawn if p.path]
        or [np.zeros(len(time), dtype=bool)],
        axis=0,
    )[:, None]
    given = Given(np.where(led, 0.0, scene.inputs), scene.enabled & ~(led & free))
    return replace(run, scenes=(given,))


KINDS: dict[str, Callable[[int, Run, np.random.Generator], Drawn | None]] = {
    'none': _nothing,
    'effect': _single,
    'pair': _pair,
    'outside': _outside,
    'triple': _triple,
    'small': draw_small,
    'pushed': _pushed,
    'strength': _strength,
}
