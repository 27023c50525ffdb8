# SPDX-License-Identifier: Apache-2.0
"""Draw effects of the catalogue that have a wanted size in a run."""

from __future__ import annotations

from collections.abc import Container, Sequence
from itertools import chain, combinations
from typing import NamedTuple

import numpy as np

from leo_diffmodel.explain.problem.candidates import candidates
from leo_diffmodel.explain.problem.classes import Facts, why_same
from leo_diffmodel.explain.problem.hypothesis import Candidate, widens
from leo_lab.blind.open_loop import OpenLoop, Run, sized
from leo_lab.blind.pushes import Push
from leo_lab.blind.scenes import Effects
from leo_lab.blind.sensing import PLAIN, Sensing
from leo_sim.effects import Placed
from leo_sim.model import Model

SIZES, LEAST_OF_PAIR = (1.0, 30.0), 2.0
ONE_LAW = (
    {'coulomb_friction', 'stribeck_friction'},
    {
        'load_dependent_friction',
        'stribeck_load_friction',
        'quadratic_load_friction',
        'directional_load_friction',
    },
)
"""Laws with a term in common: two of them together are no two causes."""


class Drawn(NamedTuple):
    """What is wrong in a case; see `case.Case`.

    Attributes:
        run: another run than the one that was given to draw in.
    """

    effects: Effects = ()
    sizes: tuple[float, ...] = ()
    small: Effects = ()
    small_sizes: tuple[float, ...] = ()
    sensing: Sensing = PLAIN
    pushes: tuple[Push, ...] = ()
    run: Run | None = None


def several(
    count: int, run: Run, rng: np.random.Generator, without: Container[str] = ()
) -> tuple[Effects, tuple[float, ...]]:
    """Effects that differ in the data, each of two noise floors or more beside the others."""
    while True:
        effects: Effects = ()
        for _ in range(count):
            wanted = LEAST_OF_PAIR, SIZES[1]
            effects += (one_of(run, effects, wanted, rng, without)[0],)
        sizes = sizes_of(run, effects)
        if min(sizes) >= LEAST_OF_PAIR and _differ(effects, run):
            return effects, sizes


def sizes_of(run: Run, effects: Effects, others: Effects = ()) -> tuple[float, ...]:
    """The size of each effect beside everything else, in noise floors."""
    everything = (*others, *effects)
    return tuple(
        float(OpenLoop(run, everything, tuple(o for o in everything if o is not p)).size(p)[0])
        for p in effects
    )


def one_of(
    run: Run,
    others: Effects,
    sizes: tuple[float, float],
    rng: np.random.Generator,
    without: Container[str] = (),
) -> tuple[Placed, float]:
    """An effect of the catalogue beside others, and its size: name, place, size, parameters.

    Args:
        run: the robot and its drive.
        others: effects that are there as well.
        sizes: least and largest, in noise floors.
        rng: draws all of it.
        without: names that are not drawn.
    """
    pool: dict[str, list[Candidate]] = {}
    for candidate in candidates(Model(run.robot, others)):
        if candidate.effect.name not in without:
            pool.setdefault(candidate.effect.name, []).append(candidate)
    first = OpenLoop(run, others, others)
    while True:
        places = pool[str(rng.choice(list(pool)))]
        chosen = places[rng.integers(len(places))]
        size, seed = log_uniform(rng, sizes), int(rng.integers(2**32))
        found = sized(run, first, others, chosen.effect.name, chosen.where, size, seed)
        narrower = [c for c in chain.from_iterable(pool.values()) if widens(chosen, c)]
        if found is not None and _wide(run, found[0], others, narrower):
            return found


def _wide(run: Run, placed: Placed, others: Effects, narrower: Sequence[Candidate]) -> bool:
    """Whether what a law does beyond narrower ones in it is no less than the least that is drawn.

    Else nothing in the data tells it from these.
    """
    if not narrower:
        return True
    loop = OpenLoop(run, (*others, placed), others)
    return all(loop.beyond(placed, law) >= SIZES[0] for law in narrower)


def _differ(effects: Effects, run: Run) -> bool:
    facts = Facts(run.robot, ever_free=run.ever_free)
    things = [place_of(placed) for placed in effects]
    return all(
        a[0] != b[0]
        and not any({a[0], b[0]} <= law for law in ONE_LAW)
        and why_same(a, b, facts) is None
        for a, b in combinations(things, 2)
    )


def place_of(placed: Placed) -> tuple[str, str]:
    """Name and place of an effect as explanations give them: 'all' for a shared one."""
    shared = placed.everywhere and len(placed.where) > 1
    return placed.effect.name, 'all' if shared else placed.where[0]


def log_uniform(rng: np.random.Generator, limits: tuple[float, float]) -> float:
    """A number whose logarithm is uniform between two limits."""
    return float(np.exp(rng.uniform(*np.log(limits))))
