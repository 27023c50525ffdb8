# SPDX-License-Identifier: Apache-2.0
"""One blind case: a robot, its noise and excitation, and what is wrong with it."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from itertools import combinations
from pathlib import Path

import numpy as np

from leo_diffmodel.blind import outside
from leo_diffmodel.blind.excitation import excitation
from leo_diffmodel.blind.open_loop import OpenLoop, Run, sized
from leo_diffmodel.blind.scenes import Effects, Given, Moving, Scene
from leo_diffmodel.explain.candidates import candidates
from leo_diffmodel.explain.classes import Facts, why_same
from leo_diffmodel.explain.hypothesis import Candidate
from leo_sim.effects import Placed
from leo_sim.model import Model
from leo_sim.robot import load_robot, Robot

ROBOTS = ('pendulum', 'torque_pendulum', 'servo_pendulum', 'double_pendulum')
ENGINES = (('pybullet', 0.0), ('rk4', 0.0019))
WALKER_ENGINES = (('pybullet', 0.0), ('rigid', 2.6e-5))
WALKER_SCENES = (('swinging', 6.0), ('standing', 4.0), ('stepping', 10.0))
"""What a walker does, and for how long [s]."""
SIZES, LEAST_OF_PAIR = (1.0, 30.0), 2.0
POSITION_NOISE = (0.5e-3, 3e-3)
RATE_NOISE = (0.02, 0.1)
ONE_LAW = {'coulomb_friction', 'stribeck_friction'}
"""Together they are a Stribeck law again."""

Drawn = tuple[Effects, tuple[float, ...]]


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
    """

    kind: str
    seed: int
    robot: Robot
    run: Run
    engine: tuple[str, float]
    effects: Effects = ()
    sizes: tuple[float, ...] = ()


def draw_case(seed: int, kind: str, walker: str | Path | None = None) -> Case:
    """The case of a seed; every second one comes from another integrator and time step.

    No other integrator knows the ground: a walker has another time step alone.

    Args:
        seed: of everything drawn.
        kind: of `KINDS`.
        walker: a robot with contacts, by name or folder; None takes the robots without, in turn.
    """
    rng = np.random.default_rng([seed, tuple(KINDS).index(kind)])
    robot = load_robot(walker or ROBOTS[seed // 2 % len(ROBOTS)])
    engine = (WALKER_ENGINES if walker else ENGINES)[seed % 2]
    while True:
        noise = (_log_uniform(rng, POSITION_NOISE), _log_uniform(rng, RATE_NOISE))
        built = _as_built(robot, rng)
        scenes = _motions(robot, rng) if walker else (Given(*excitation(robot, rng)),)
        run = Run(built, scenes, noise)
        drawn = KINDS[kind](seed, run, rng)
        if drawn is not None:
            return Case(kind, seed, robot, run, engine, *drawn)


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
    return (), ()


def _single(seed: int, run: Run, rng: np.random.Generator) -> Drawn:
    placed, size = _drawn(run, (), SIZES, rng)
    return (placed,), (size,)


def _several(count: int, run: Run, rng: np.random.Generator) -> Drawn:
    """Effects that differ in the data, each of two noise floors or more beside the others."""
    while True:
        effects: Effects = ()
        for _ in range(count):
            effects += (_drawn(run, effects, (LEAST_OF_PAIR, SIZES[1]), rng)[0],)
        sizes = tuple(
            float(OpenLoop(run, effects, effects[:i] + effects[i + 1 :]).size(placed)[0])
            for i, placed in enumerate(effects)
        )
        if min(sizes) >= LEAST_OF_PAIR and _differ(effects, run):
            return effects, sizes


def _pair(seed: int, run: Run, rng: np.random.Generator) -> Drawn:
    return _several(2, run, rng)


def _triple(seed: int, run: Run, rng: np.random.Generator) -> Drawn:
    return _several(3, run, rng)


def _outside(seed: int, run: Run, rng: np.random.Generator) -> Drawn | None:
    """A law of no catalogue, each kind on every robot in turn; None in a run that hides it."""
    kind = outside.KINDS[seed // (2 * len(ROBOTS)) % len(outside.KINDS)]
    drawn = outside.draw(kind, run, rng)
    return drawn and ((drawn[0],), (drawn[1],))


KINDS: dict[str, Callable[[int, Run, np.random.Generator], Drawn | None]] = {
    'none': _nothing, 'effect': _single, 'pair': _pair, 'outside': _outside,
    'triple': _triple,
}  # fmt: skip


def _drawn(
    run: Run, others: Effects, sizes: tuple[float, float], rng: np.random.Generator
) -> tuple[Placed, float]:
    """An effect of the catalogue beside others, and its size: name, place, size, parameters."""
    pool: dict[str, list[Candidate]] = {}
    for candidate in candidates(Model(run.robot, others)):
        pool.setdefault(candidate.effect.name, []).append(candidate)
    first = OpenLoop(run, others, others)
    while True:
        places = pool[str(rng.choice(list(pool)))]
        chosen = places[rng.integers(len(places))]
        size, seed = _log_uniform(rng, sizes), int(rng.integers(2**32))
        found = sized(run, first, others, chosen.effect.name, chosen.where, size, seed)
        if found is not None:
            return found


def _differ(effects: Effects, run: Run) -> bool:
    facts = Facts(run.robot, ever_free=run.ever_free)
    things = [place_of(placed) for placed in effects]
    return all(
        a[0] != b[0] and {a[0], b[0]} != ONE_LAW and why_same(a, b, facts) is None
        for a, b in combinations(things, 2)
    )  # fmt: skip


def place_of(placed: Placed) -> tuple[str, str]:
    """Name and place of an effect as explanations give them: 'all' for a shared one."""
    shared = placed.everywhere and len(placed.where) > 1
    return placed.effect.name, 'all' if shared else placed.where[0]


def _log_uniform(rng: np.random.Generator, limits: tuple[float, float]) -> float:
    return float(np.exp(rng.uniform(*np.log(limits))))
