# SPDX-License-Identifier: Apache-2.0
"""Draw an effect that matters: so large that a policy trained without it may well fail.

The size is the rms change of the noise-free open loop over half a second, in nominal noise
floors, log-uniform between 60 and 200: a bob of 55 g that lacks 15 to 90 g, say.
"""

from collections.abc import Callable
import math
from typing import Any, Protocol

import numpy as np

from leo_msgs_py.errors import UserError
from leo_sim.common.broadcasting import Numbers
from leo_sim.description.robot import Robot
from leo_sim.effects import EFFECTS, place
from leo_sim.effects.base import Parameter, Placed
from leo_sim.model.batch import rollout
from leo_sim.model.model import Model

FLOOR_POSITION, FLOOR_VELOCITY = 1e-3, 0.05
"""Nominal measurement noise, standard deviation [rad], [rad/s]."""

SIZES = (60.0, 200.0)  # least and largest size of a drawn effect, in noise floors
SIZES_ON_GROUND = (8.0, 30.0)  # of a walker, whose many joints share one effect's change

AMPLITUDES = np.geomspace(1e-7, 1e2, 109)
"""Tried amplitudes, in the unit of the effect's first parameter."""
COARSE = 9
"""Of a robot on the ground one amplitude in so many is tried first: its runs are expensive."""
MOST = {'': 0.5, 's': 0.1, 'rad': 0.3}
"""Largest sensible amplitude by unit of the first parameter: half as strong, 0.1 s late."""

GROWS = ('link_mass', 'link_inertia')
SHRINKS = ('voltage_limit',)
NEAR_REST = ('stribeck_friction', 'stribeck_load_friction')
LATER = ('encoder_scale', 'velocity_lag', 'measurement_delay')
LAST_DRAWN = 'measurement_delay'
"""Effects that joined the catalogue after it are hidden by files alone: seeds keep secrets."""

PLACE = 0.1  # of a payload, from the origin of its link [m]
BEGINS = (3.0, 15.0)  # when a late one is hung on [s]
SETTLES = (2.0, 10.0)  # time constant of what changes while it runs [s]
WINDOWS, SECONDS = 16, 0.5

Rng = np.random.Generator
Shape = dict[str, tuple[float, float]]
"""Per parameter its value at amplitude 0 and its slope over the amplitude."""


def draw(robot: Robot, rng: Rng) -> Placed:
    """An effect of the catalogue, its place and parameters drawn; UserError: none shows."""
    windows = Windows(robot, rng)
    for name in _order(robot, rng):
        places = EFFECTS[name].places(robot)
        where = 'all' if EFFECTS[name].undivided else places[rng.integers(len(places))]
        size = math.exp(rng.uniform(*np.log(SIZES_ON_GROUND if robot.contacts else SIZES)))
        if (placed := of_size(windows, name, where, size, rng)) is not None:
            return placed
    raise UserError(f'no effect of the catalogue shows on {robot.name}')


def _order(robot: Robot, rng: Rng) -> list[str]:
    """Effects that this robot can have, in random order.

    Where those that joined the catalogue later come is drawn apart: a seed keeps its secret.
    """
    _, later = rng.spawn(2)
    drawn = list(EFFECTS)[: list(EFFECTS).index(LAST_DRAWN) + 1]
    possible = [name for name in sorted(drawn) if EFFECTS[name].applies(robot)]
    order = rng.permutation([name for name in possible if name not in LATER]).tolist()
    for name in possible:
        if name in LATER:
            order.insert(later.integers(len(order) + 1), name)
    return order


class Sized(Protocol):
    robot: Robot

    def size(self, placed: Placed) -> np.ndarray:
        """In noise floors, for each of the effect's leading amplitudes."""


def of_size(windows: Sized, name: str, where: str, size: float, rng: Rng) -> Placed | None:
    """The effect at a place, or 'all', of so many noise floors; None: no amplitude makes it so."""
    robot = windows.robot
    names = EFFECTS[name].places(robot) if where == 'all' else (where,)
    parameters = EFFECTS[name].parameters_for(robot, names)
    shape = _shape(name, parameters, robot, rng)
    amplitudes = AMPLITUDES[MOST.get(parameters[0].unit, math.inf) >= AMPLITUDES]

    def sizes(tried: np.ndarray) -> np.ndarray:
        values = _values(shape, parameters, tried[:, None, None])
        return windows.size(place(robot, name, where, **values))

    ends = _bracket(sizes, amplitudes, size, COARSE if robot.contacts else 1)
    if ends is None:
        return None
    amplitude = np.exp(np.interp(np.log(size), *np.log(ends)))
    return place(robot, name, where, **_values(shape, parameters, float(amplitude)))


def _bracket(
    sizes: Callable[[np.ndarray], np.ndarray], amplitudes: np.ndarray, size: float, stride: int
) -> tuple[np.ndarray, np.ndarray] | None:
    """Sizes and amplitudes just before and just after a size is first reached.

    Sizes are of amplitudes in rising order; one in `stride` is tried first, then those between.
    """
    tried = amplitudes[::stride]
    found = sizes(tried)
    reached = np.flatnonzero(np.isfinite(found) & (found >= size))
    if not reached.size or reached[0] == 0 or not found[reached[0] - 1] > 0.0:
        return None
    before = int(reached[0]) - 1
    if stride > 1:
        between = amplitudes[before * stride : (before + 1) * stride + 1]
        return _bracket(sizes, between, size, 1)
    return found[before : before + 2], tried[before : before + 2]


def _shape(name: str, parameters: tuple[Parameter, ...], robot: Robot, rng: Rng) -> Shape:
    """How the parameters follow one amplitude; signs, directions and angles are drawn."""
    angle = rng.uniform(-np.pi, np.pi)
    if name in NEAR_REST:
        level, at_rest, v_s = (p.name for p in parameters)
        more, speed = rng.uniform(1.3, 2.0), rng.uniform(0.2, 1.0)
        return {level: (0.0, 1.0), at_rest: (0.0, more), v_s: (speed, 0.0)}
    if name in ('warming_friction', 'torque_fade'):
        level, *cold, time = (p.name for p in parameters)
        falls = {begin: (0.0, rng.uniform(1.5, 3.0)) for begin in cold}
        return {level: (0.0, 1.0), **falls, time: (rng.uniform(*SETTLES), 0.0)}
    if name == 'directional_load_friction':
        return {'mu': (0.0, 1.0), 'mu_back': (0.0, rng.choice([0.3, 3.0]))}
    if name == 'quadratic_load_friction':
        strongest = max((a.stall for a in robot.actuators), default=1.0)
        return {'mu': (0.0, 0.3), 'mu2': (0.0, 2.0 / strongest)}
    if name == 'joint_spring':
        return {'k': (0.0, 1.0), 'rest': (angle, 0.0)}
    if name in ('payload', 'late_payload'):
        x, z = PLACE * math.cos(angle), PLACE * math.sin(angle)
        begin = {'t0': (rng.uniform(*BEGINS), 0.0)} if name == 'late_payload' else {}
        return {'m': (0.0, 1.0), 'x': (x, 0.0), 'z': (z, 0.0), **begin}
    if name == 'torque_ripple':
        return {'a': (0.0, 1.0), 'n': (float(rng.integers(2, 9)), 0.0), 'phase': (angle, 0.0)}
    if {p.name for p in parameters} in ({'x', 'z'}, {'a', 'b'}):
        ways = math.cos(angle), math.sin(angle)
        return {p.name: (0.0, way) for p, way in zip(parameters, ways, strict=True)}
    first, *others = parameters
    sign = 1.0 if first.low >= first.neutral or name in GROWS else rng.choice([-1.0, 1.0])
    sign = -1.0 if name in SHRINKS else float(sign)
    return {first.name: (first.neutral, sign), **{p.name: (p.neutral, 0.0) for p in others}}


def _values(shape: Shape, parameters: tuple[Parameter, ...], amplitude: Numbers) -> dict[str, Any]:
    bounds = {p.name: (p.low, p.high) for p in parameters}
    return {
        name: np.clip(offset + slope * amplitude, *bounds[name])
        for name, (offset, slope) in shape.items()
    }


class Windows:
    """Half-second runs of the ideal robot with random inputs, from states it comes by itself."""

    def __init__(self, robot: Robot, rng: Rng) -> None:
        self.robot = robot
        model = Model(robot, scheme='training')
        self._dt = robot.control_period
        steps = max(1, round(SECONDS / self._dt))
        limits = robot.limits
        inputs = rng.uniform(-1.0, 1.0, (1, WINDOWS * steps, len(limits))) * limits
        start = model.start('nominal', rng)
        q, dq = rollout(model, start.q[None], start.dq[None], inputs, self._dt)
        self._q0, self._dq0 = q[0, :-1:steps], dq[0, :-1:steps]
        self._inputs = inputs.reshape(WINDOWS, steps, len(limits))
        self._ideal = self._run(())

    def size(self, placed: Placed) -> np.ndarray:
        """Rms change over the noise floor, for each of the effect's leading amplitudes."""
        q, dq = self._run((placed,))
        change = np.concatenate(
            [(q - self._ideal[0]) / FLOOR_POSITION, (dq - self._ideal[1]) / FLOOR_VELOCITY], -1
        )
        with np.errstate(over='ignore', invalid='ignore'):
            return np.sqrt(np.mean(change[..., 1:, :] ** 2, axis=(-3, -2, -1)))

    def _run(self, effects: tuple[Placed, ...]) -> tuple[np.ndarray, np.ndarray]:
        with np.errstate(all='ignore'):
            model = Model(self.robot, effects, scheme='training')
            start = SECONDS * np.arange(WINDOWS)
            return rollout(model, self._q0, self._dq0, self._inputs, self._dt, start=start)
