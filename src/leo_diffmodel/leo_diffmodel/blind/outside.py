# SPDX-License-Identifier: Apache-2.0
"""What no catalogue holds: five kinds of laws that must come out as unknown."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from leo_diffmodel.blind import kinds
from leo_diffmodel.compare.sizes import gravity_scale
from leo_sim.batch import rollout
from leo_sim.drawing import FLOOR_POSITION, FLOOR_VELOCITY
from leo_sim.effects import get_effect, place, Placed
from leo_sim.model import Model
from leo_sim.robot import Robot

Array = np.ndarray
Values = dict[str, float]
SIZES = (8.0, 30.0)
"""Rms change of the 0.5 s open loop, in noise floors of 1 mrad and 0.05 rad/s."""
RUN_SECONDS, AHEAD, HISTORY = 20.0, 0.5, 1.0
VOLTAGE_LEVEL, GRAVITY_LEVEL = 0.6, 0.4
HOLD = 0.3
ROUNDS = 3
AMPLITUDES = np.geomspace(1e-6, 30.0, 30)
STRONGEST = {'': 2.0}


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


def draw(
    kind: str, robot: Robot, rng: np.random.Generator, inputs: Array | None = None
) -> Placed:
    """A law of one kind at a joint of the robot, several noise floors large.

    Args:
        kind: one of `KINDS`.
        robot: the robot.
        rng: draws the joint, the shape of the law and its size.
        inputs: of the run it must show in [V or N m], shape (N, A); by default random steps.
    """
    effect = get_effect(str(Path(kinds.__file__).with_name(f'{kind}.py')))
    where = str(rng.choice(effect.places(robot)))
    inputs = _steps(robot, rng) if inputs is None else inputs
    reach = _Run(robot, inputs, ()).reach(where)
    while True:
        shape = SHAPES[kind](reach, rng)
        target = float(np.exp(rng.uniform(*np.log(SIZES))))
        placed = _sized(robot, inputs, place(robot, effect, where, **shape), target)
        if SIZES[0] / 2 < float(_Run(robot, inputs, (placed,)).size(placed)[0]) < 2 * SIZES[1]:
            return placed


def _sized(robot: Robot, inputs: Array, shape: Placed, target: float) -> Placed:
    """The law with the wanted size in the run that it itself causes: a few rounds settle both."""
    first = shape.effect.parameters[0]
    effects: tuple[Placed, ...] = ()
    for _ in range(ROUNDS):
        scan = _stronger(shape, AMPLITUDES[:, None, None])
        amplitude = _amplitude(_Run(robot, inputs, effects).size(scan), target)
        effects = (_stronger(shape, min(amplitude, STRONGEST.get(first.unit, np.inf))),)
    return effects[0]


def _stronger(placed: Placed, amplitude: Any) -> Placed:
    first = placed.effect.parameters[0].name
    return replace(placed, parameters={**placed.parameters, first: amplitude})


def _amplitude(sizes: Array, target: float) -> float:
    """The smallest amplitude that gives the size, between the points of the scan."""
    sizes = np.where(np.isfinite(sizes), sizes, np.inf)
    above = np.flatnonzero(sizes >= target)
    at = int(above[0]) if above.size else len(sizes) - 1
    share = np.log(target / sizes[at - 1]) / np.log(sizes[at] / sizes[at - 1])
    step = np.log(AMPLITUDES[at] / AMPLITUDES[at - 1])
    return float(AMPLITUDES[at - 1] * np.exp(np.clip(share, 0.0, 1.0) * step))


def _steps(robot: Robot, rng: np.random.Generator) -> Array:
    """Steps of random size, shape (N, A)."""
    count = round(RUN_SECONDS / robot.control_period)
    index = (np.arange(count) * robot.control_period / HOLD + 1e-9).astype(int)
    values = rng.uniform(-1, 1, (index[-1] + 1, len(robot.actuators)))
    if robot.input == 'torque':
        return GRAVITY_LEVEL * gravity_scale(robot) * values[index]
    return VOLTAGE_LEVEL * np.array([a.limit for a in robot.actuators]) * values[index]


class _Run:
    """A run with these effects, and half-second open loops from all along it."""

    def __init__(self, robot: Robot, inputs: Array, effects: tuple[Placed, ...]) -> None:
        self._robot, self._dt = robot, robot.control_period
        model = Model(robot, effects)
        start = model.start('nominal')
        q, dq = rollout(model, start.q[None], start.dq[None], inputs[None], self._dt)
        self._track = q[0]
        steps, past = round(AHEAD / self._dt), round(HISTORY / self._dt)
        first = np.arange(past, len(inputs) - steps, 2 * steps)
        pick = first[:, None] + np.arange(-past, 0)
        held = inputs[pick]
        self._history = (q[0, pick], dq[0, pick], held, None, np.full(held.shape[:2], self._dt))
        self._start, self._q, self._dq = first * self._dt, q[0, first], dq[0, first]
        self._inputs = inputs[first[:, None] + np.arange(steps)]
        self._ideal = self._end(())

    def reach(self, joint: str) -> Array:
        """Angles between which the joint is for most of the time [rad], shape (2,)."""
        angle = self._track[:, self._robot.joint_names.index(joint)]
        return np.quantile(angle, (0.15, 0.85))

    def size(self, placed: Placed) -> Array:
        """Rms change over the noise floor for each leading amplitude, shape (S,)."""
        change = self._end((placed,)) - self._ideal
        with np.errstate(all='ignore'):
            return np.atleast_1d(np.sqrt((change**2).mean(axis=(-2, -1))))

    def _end(self, effects: tuple[Placed, ...]) -> Array:
        """States after half a second in noise floors, shape (..., W, 2J)."""
        model = Model(self._robot, effects)
        q, dq = rollout(model, self._q, self._dq, self._inputs, self._dt,
                        history=self._history, start=self._start)  # fmt: skip
        ends = (q[..., -1, :] / FLOOR_POSITION, dq[..., -1, :] / FLOOR_VELOCITY)
        return np.concatenate(ends, axis=-1)
