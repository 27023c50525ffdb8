# SPDX-License-Identifier: Apache-2.0
"""Worlds that are wrong in many small ways, each below one noise floor, beside what is hidden."""

from __future__ import annotations

from collections.abc import Sequence
from contextlib import suppress
from dataclasses import replace
from pathlib import Path

import numpy as np

from leo_diffmodel.compare.sizes import torque_scale
from leo_lab.blind import kinds
from leo_lab.blind.drawn import Drawn, log_uniform, one_of, several, sizes_of
from leo_lab.blind.open_loop import OpenLoop, Run
from leo_lab.blind.outside import amplitude_of, SHAPES, stronger
from leo_lab.blind.scenes import Effects, Given
from leo_lab.blind.sensing import counted, draw_sensing, lag_size, MOST, Sensing
from leo_msgs_py.errors import UserError
from leo_sim.description.robot import Robot
from leo_sim.effects import Effect, EFFECTS, get_effect, place, Placed
from leo_sim.truth.drawing import of_size

Array = np.ndarray
COUNT = (4, 8)
"""Small differences of a case, those of its measurement included."""
LEAST = 3
"""Of them in the robot itself, one less where sizes do not come out."""
FLOORS, LARGE, OVER = (0.2, MOST), (2.0, 30.0), 1.15
AIMED = (0.25, 0.8)
"""Within `FLOORS`, because sizes are a little other beside each other."""
CATALOGUE = ('link_mass', 'link_com', 'torque_scale', 'back_emf_scale')
LAWS = ('asymmetric_friction', 'cable', 'winding_drift')
FILTER = 'velocity_lag'
NOT_IN_MUJOCO = ('backlash', *(name for name, e in EFFECTS.items() if e.uses_load))
ENCODERS = ('differenced', 'counts', 'filtered')
SLOW, SLOW_CASES = 3, 4
"""Every third state alone is published (33 Hz) in every fourth case."""
AMPLITUDES = np.geomspace(1e-6, 0.5, 40)
"""Tried amplitudes, in the robot's largest torque (a turn, or a share)."""


def draw_small(seed: int, run: Run, rng: np.random.Generator) -> Drawn:
    """A third of the seeds hide nothing large, a third one effect, a third two."""
    every = SLOW if rng.integers(SLOW_CASES) == 0 else 1
    sensing, filtered = _encoder(run, every, rng)
    run = replace(_held(run, every), noise=sensing.seen_noise)
    without = (*NOT_IN_MUJOCO, *((FILTER,) if sensing.differenced or filtered else ()))
    while True:
        effects = _large(hidden_count(seed, run), run, rng, without)
        with suppress(UserError):  # together they send the robot away
            drawn = _beside_small(run, effects, sensing, filtered, rng)
            if drawn is not None:
                return drawn


def _beside_small(
    run: Run, effects: Effects, sensing: Sensing, filtered: bool, rng: np.random.Generator
) -> Drawn | None:
    """The world around effects; None where it takes one of them out of `LARGE`."""
    loop = OpenLoop(run, effects, effects)
    sensing = draw_sensing(loop, sensing, rng)
    count = max(int(rng.integers(*COUNT, endpoint=True)) - sensing.faults, LEAST)
    small, small_sizes = _small(run, effects, loop, count, filtered, rng)
    if len(small) < LEAST - 1 or len(small) + sensing.faults < COUNT[0]:
        return None
    sizes = sizes_of(run, effects, small)
    if not all(LARGE[0] <= size <= OVER * LARGE[1] for size in sizes):
        return None
    return Drawn(effects, sizes, small, small_sizes, sensing, run=run)


def _held(run: Run, every: int) -> Run:
    """The run with inputs that change when a state is published; a walker's do anyhow."""
    scenes = tuple(
        replace(s, inputs=np.repeat(s.inputs[::every], every, axis=0)[: s.count])
        if isinstance(s, Given)
        else s
        for s in run.scenes
    )
    return replace(run, scenes=scenes)


def hidden_count(seed: int, run: Run) -> int:
    """How many large effects a seed hides: each number on every robot and engine in turn."""
    return seed // (2 if run.robot.contacts else 8) % 3


def _encoder(run: Run, every: int, rng: np.random.Generator) -> tuple[Sensing, bool]:
    """How angles and rates are measured, and whether rates are filtered.

    Differenced rates come half a period late; where that is worth too much they are measured.
    """
    kind = str(rng.choice(ENCODERS))
    if kind == 'filtered':
        return Sensing(run.noise, every=every), True
    late = counted(run.noise, True, every)
    if kind == 'differenced':
        size = lag_size(OpenLoop(replace(run, noise=late.seen_noise), ()), late.period)
        if size < MOST:
            return replace(late, sizes=(('differenced_rates', size),)), False
    return counted(run.noise, False, every), False


def _large(count: int, run: Run, rng: np.random.Generator, without: Sequence[str]) -> Effects:
    if count == 0:
        return ()
    if count == 1:
        return (one_of(run, (), LARGE, rng, without)[0],)
    return several(count, run, rng, without)[0]


def _small(
    run: Run, large: Effects, loop: OpenLoop, count: int, filtered: bool, rng: np.random.Generator
) -> tuple[Effects, tuple[float, ...]]:
    """So many differences where the robot has them, each within `FLOORS` beside all others."""
    paths = run.paths(large)
    taken = {(p.effect.name, where) for p in large for where in p.where}
    pool = [(e, w) for e in _laws() for w in e.places(run.robot) if (e.name, w) not in taken]
    order = [pool[i] for i in rng.permutation(len(pool))]
    if filtered:
        order.insert(0, (EFFECTS[FILTER], 'all'))
    small: Effects = ()
    for effect, where in order:
        if len(small) < count:
            reach = _reach(run, paths, where)
            placed = _placed(loop, effect, where, reach, log_uniform(rng, AIMED), rng)
            small += () if placed is None else (placed,)
    return _trimmed(run, large, small)


def _laws() -> list[Effect]:
    folder = Path(kinds.__file__).parent
    return [
        *(EFFECTS[name] for name in CATALOGUE),
        *(get_effect(str(folder / f'{name}.py')) for name in LAWS),
    ]


def _reach(run: Run, paths: Sequence, where: str) -> Array:
    """Angles between which a joint is for most of the run [rad], (2,); 0 for a link."""
    if where not in run.robot.joint_names:
        return np.zeros(2)
    q = np.concatenate([path.q for path in paths])[:, run.robot.joint_names.index(where)]
    return np.quantile(q, (0.15, 0.85))


def _placed(
    loop: OpenLoop, effect: Effect, where: str, reach: Array, size: float, rng: np.random.Generator
) -> Placed | None:
    """A difference of so many noise floors; None where it cannot be that large."""
    if not effect.applies(loop.robot):
        return None
    if effect.name in EFFECTS:
        return of_size(loop, effect.name, where, size, rng)
    shape = place(loop.robot, effect, where, **_shape(effect.name, reach, rng))
    amplitudes = AMPLITUDES * (torque_scale(loop.robot) if effect.parameters[0].unit else 1.0)
    sizes = loop.size(stronger(shape, amplitudes[:, None, None]))
    if not sizes[0] < size < np.nanmax(sizes):
        return None
    return stronger(shape, amplitude_of(amplitudes, sizes, size))


def _shape(name: str, reach: Array, rng: np.random.Generator) -> dict[str, float]:
    if name in SHAPES:
        return SHAPES[name](reach, rng)
    return {'skew': float(rng.choice([-1.0, 1.0]) * rng.uniform(0.2, 0.8))}


def _trimmed(run: Run, large: Effects, small: Effects) -> tuple[Effects, tuple[float, ...]]:
    """Sizes beside all others; what has left `FLOORS` is made right once, or left out."""
    sizes = sizes_of(run, small, large)
    fitted = tuple(
        p if _fits(s) else _scaled(run.robot, p, float(np.mean(AIMED)) / s)
        for p, s in zip(small, sizes, strict=True)
        if s > 0
    )
    if fitted != small:
        sizes = sizes_of(run, fitted, large)
    while not all(map(_fits, sizes)):
        fitted = tuple(p for p, size in zip(fitted, sizes, strict=True) if _fits(size))
        sizes = sizes_of(run, fitted, large)
    return fitted, sizes


def _fits(size: float) -> bool:
    return FLOORS[0] <= size <= FLOORS[1]


def _scaled(robot: Robot, placed: Placed, share: float) -> Placed:
    """With all amplitudes so much larger: x, y and z of a shift go together."""
    first = placed.effect.parameters[0]
    both = {'x', 'y', 'z'} & placed.parameters.keys() or {first.name}
    neutral = {p.name: p.neutral for p in placed.effect.parameters_for(robot, placed.where)}
    return replace(
        placed,
        parameters={
            name: neutral[name] + share * (value - neutral[name]) if name in both else value
            for name, value in placed.parameters.items()
        },
    )
