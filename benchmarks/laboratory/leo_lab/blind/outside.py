# SPDX-License-Identifier: Apache-2.0
"""What no catalogue holds: five kinds of laws that must come out as unknown."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from leo_diffmodel.compare.sizes import torque_scale
from leo_lab.blind import kinds
from leo_lab.blind.open_loop import OpenLoop, Run
from leo_sim.effects import get_effect, place, Placed

Array = np.ndarray
Values = dict[str, float]
SIZES = (6.0, 30.0)
"""Rms change of the 0.5 s open loop, in noise floors."""
LEAST = 3.0
MOVING, WEAKER = 0.3, 0.6
"""Share of its reach that a joint must keep: a joint that the law holds still shows nothing."""
ROUNDS = 3
TRIES = 20
AMPLITUDES = np.geomspace(1e-4, 0.5, 24)
"""Tried amplitudes, in the robot's largest torque (a turn, or a share)."""


def _periodic(reach: Array, rng: np.random.Generator) -> Values:
    return {'f': float(rng.uniform(0.3, 3.0)), 'phase': float(rng.uniform(-np.pi, np.pi))}


def _sector(reach: Array, rng: np.random.Generator) -> Values:
    width = min(0.25 * float(reach[1] - reach[0]), 0.6)
    return {'centre': float(rng.uniform(*reach)), 'width': width}


def _cable(reach: Array, rng: np.random.Generator) -> Values:
    middle, half = reach.mean(), 0.25 * np.ptp(reach)
    slack = float(rng.uniform(middle - half, middle + half))
    return {'slack': slack, 'side': float(rng.choice([-1.0, 1.0]))}


def _hysteresis(reach: Array, rng: np.random.Generator) -> Values:
    return {'reach': min(float(rng.uniform(0.2, 0.6) * np.ptp(reach)), 1.0)}


def _drift(reach: Array, rng: np.random.Generator) -> Values:
    return {'tau': float(rng.uniform(4.0, 15.0))}


SHAPES: dict[str, Callable[[Array, np.random.Generator], Values]] = {
    'periodic_torque': _periodic,
    'sector_friction': _sector,
    'cable': _cable,
    'hysteresis': _hysteresis,
    'winding_drift': _drift,
}
KINDS = tuple(SHAPES)
VARIABLES = {'periodic_torque': 'time', 'sector_friction': 'angle', 'cable': 'angle'}
"""The variable that explains each of the first three kinds."""


def draw(kind: str, run: Run, rng: np.random.Generator) -> tuple[Placed, float] | None:
    """A law of one kind at a joint of a robot, and its size in noise floors; None: no way to show.

    Args:
        kind: one of `KINDS`.
        run: the robot and what drives it; the law must show there.
        rng: draws the joint, the shape of the law and its size.
    """
    effect = get_effect(str(Path(kinds.__file__).with_name(f'{kind}.py')))
    where = str(rng.choice(effect.places(run.robot)))
    reach = _reach(run, where, ())
    for _ in range(TRIES):
        shape = place(run.robot, effect, where, **SHAPES[kind](reach, rng))
        placed = _sized(run, shape, float(np.exp(rng.uniform(*np.log(SIZES)))))
        while np.ptp(_reach(run, where, (placed,))) < MOVING * np.ptp(reach):
            placed = stronger(placed, WEAKER * placed.parameters[effect.parameters[0].name])
        size = float(OpenLoop(run, (placed,)).size(placed)[0])
        if LEAST < size < 2 * SIZES[1]:
            return placed, size
    return None


def _reach(run: Run, joint: str, effects: tuple[Placed, ...]) -> Array:
    """Angles between which the joint is for most of the run [rad], shape (2,)."""
    q = np.concatenate([path.q for path in run.paths(effects)])
    return np.quantile(q[:, run.robot.joint_names.index(joint)], (0.15, 0.85))


def _sized(run: Run, shape: Placed, target: float) -> Placed:
    """The law with the wanted size in the run that it itself causes: a few rounds settle both."""
    first = shape.effect.parameters[0]
    amplitudes = AMPLITUDES * (torque_scale(run.robot) if first.unit else 1.0)
    effects: tuple[Placed, ...] = ()
    for _ in range(ROUNDS):
        sizes = OpenLoop(run, effects).size(stronger(shape, amplitudes[:, None, None]))
        effects = (stronger(shape, amplitude_of(amplitudes, sizes, target)),)
    return effects[0]


def stronger(placed: Placed, amplitude: Any) -> Placed:
    """The law with another first parameter."""
    first = placed.effect.parameters[0].name
    return replace(placed, parameters={**placed.parameters, first: amplitude})


def amplitude_of(amplitudes: Array, sizes: Array, target: float) -> float:
    """The smallest amplitude that gives the size, between the points of the scan."""
    above = np.flatnonzero(~(sizes < target))
    at = max(int(above[0]), 1) if above.size else len(sizes) - 1
    with np.errstate(all='ignore'):
        share = np.log(target / sizes[at - 1]) / np.log(sizes[at] / sizes[at - 1])
    step = np.log(amplitudes[at] / amplitudes[at - 1])
    return float(amplitudes[at - 1] * np.exp(np.clip(np.nan_to_num(share), 0.0, 1.0) * step))
