# SPDX-License-Identifier: Apache-2.0
"""One blind case: a robot, its noise and excitation, and what is wrong with it."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from leo_sim.batch import rollout
from leo_sim.drawing import of_size
from leo_sim.effects import EFFECTS, Placed
from leo_sim.model import Model
from leo_sim.robot import load_robot, Robot

Array = np.ndarray
ROBOTS = ('pendulum', 'torque_pendulum')
SECONDS = 20.0
RATE = 100.0
AHEAD = 0.5
HISTORY = 0.15
ROUNDS = 6
TOLERANCE = 0.15
SIZES = (1.0, 30.0)
POSITION_NOISE = (0.5e-3, 3e-3)
RATE_NOISE = (0.02, 0.1)
FASTEST, GENTLER = 30.0, 0.7
LEVELS = {'voltage': (0.4, 1.0), 'torque': (0.1, 0.4)}
ENGINES = (('pybullet', 0.0), ('rk4', 0.0019))
EFFECT_NAMES = (
    'command_delay', 'voltage_scale', 'voltage_deadband', 'voltage_limit', 'actuator_lag',
    'torque_scale', 'back_emf_scale', 'viscous_friction', 'coulomb_friction',
    'stribeck_friction', 'load_dependent_friction', 'quadratic_drag', 'bias_torque',
    'joint_spring', 'backlash', 'armature', 'torque_ripple', 'link_mass', 'link_inertia',
    'external_force', 'encoder_offset',
)  # fmt: skip


@dataclass(frozen=True)
class Case:
    """All that a case is; `effect` is the truth and stays with the benchmark.

    Attributes:
        seed: of everything drawn.
        robot: the robot.
        noise: standard deviation of angle [rad] and rate [rad/s].
        inputs: input of each control period [V or N m], shape (N, A).
        engine: physics engine of the robot and its integration step [s] (0: the robot's own).
        effect: the hidden effect, None for a no-effect case.
        size: rms change of the noise-free 0.5 s open loop over the noise floor there.
    """

    seed: int
    robot: Robot
    noise: tuple[float, float]
    inputs: Array
    engine: tuple[str, float]
    effect: Placed | None
    size: float


def draw_case(seed: int, with_effect: bool) -> Case:
    """The case of a seed; every second one comes from another integrator and time step."""
    rng = np.random.default_rng([seed, int(with_effect)])
    robot = load_robot(ROBOTS[seed // 2 % len(ROBOTS)])
    noise = (_log_uniform(rng, POSITION_NOISE), _log_uniform(rng, RATE_NOISE))
    inputs = excitation(robot, rng)
    engine = ENGINES[seed % 2]
    if not with_effect:
        return Case(seed, robot, noise, inputs, engine, None, 0.0)
    while True:
        effect = EFFECTS[rng.choice(EFFECT_NAMES)]
        if not effect.applies(robot):
            continue
        where = str(rng.choice(effect.places(robot)))
        size, shape_seed = _log_uniform(rng, SIZES), int(rng.integers(2**32))
        found = _sized(robot, inputs, noise, effect.name, where, size, shape_seed)
        if found is not None:
            return Case(seed, robot, noise, inputs, engine, *found)


def _sized(
    robot: Robot,
    inputs: Array,
    noise: tuple[float, float],
    name: str,
    where: str,
    size: float,
    shape_seed: int,
) -> tuple[Placed, float] | None:
    """The effect with the wanted size in the run that it itself causes; None where it has none.

    The run depends on the effect, and its size on the run: a few rounds settle both.
    """
    placed: Placed | None = None
    for _ in range(ROUNDS):
        loop = OpenLoop(robot, inputs, noise, () if placed is None else (placed,))
        if placed is not None:
            reached = float(loop.size(placed)[0])
            if abs(np.log(reached / size)) < TOLERANCE:
                return placed, reached
        shape = np.random.default_rng(shape_seed)
        placed = of_size(loop, name, where, size, shape)  # type: ignore[arg-type]
        if placed is None:
            return None
    return None


def excitation(robot: Robot, rng: np.random.Generator) -> Array:
    """Random steps, a sum of sines, a chirp or a random binary signal, shape (N, A)."""
    count = round(SECONDS / robot.control_period)
    time = np.arange(count) * robot.control_period
    limits = np.array([a.limit for a in robot.actuators])
    level = rng.uniform(*LEVELS[robot.input])
    signals = [_signal(rng, time, str(rng.choice(['steps', 'sines', 'chirp', 'binary'])))
               for _ in limits]  # fmt: skip
    inputs = level * limits * np.stack(signals, axis=-1)
    while _fastest(robot, inputs) > FASTEST:
        inputs = GENTLER * inputs
    return inputs


def _fastest(robot: Robot, inputs: Array) -> float:
    """The largest joint rate of the ideal robot [rad/s], each quarter of the run from its start."""
    model, parts = Model(robot), 4
    start = model.start('nominal')
    split = inputs[: len(inputs) // parts * parts].reshape(parts, -1, inputs.shape[-1])
    q, dq = (np.repeat(x[None], parts, axis=0) for x in (start.q, start.dq))
    return float(np.abs(rollout(model, q, dq, split, robot.control_period)[1]).max())


def _signal(rng: np.random.Generator, time: Array, kind: str) -> Array:
    if kind == 'sines':
        waves = [np.sin(2 * np.pi * rng.uniform(0.2, 3) * time + rng.uniform(0, 6)) for _ in 'abc']
        return np.sum(waves, axis=0) / 2
    if kind == 'chirp':
        low, high = rng.uniform(0.1, 0.4), rng.uniform(2, 4)
        phase = 2 * np.pi * (low * time + 0.5 * (high - low) / time[-1] * time**2)
        return np.sin(phase)
    hold = rng.uniform(0.1, 0.5)
    index = np.floor(time / hold).astype(int)
    values = rng.uniform(-1, 1, index[-1] + 1)
    return (np.sign(values) if kind == 'binary' else values)[index]


class OpenLoop:
    """Half-second open loops along a robot's run, beside the noise floor there."""

    def __init__(
        self,
        robot: Robot,
        inputs: Array,
        noise: tuple[float, float],
        effects: tuple[Placed, ...],
    ) -> None:
        """Run a robot with these effects and the case's inputs; take windows off its track."""
        self.robot, self._dt = robot, robot.control_period
        start = Model(robot).start('nominal')
        q, dq = rollout(
            Model(robot, effects), start.q[None], start.dq[None], inputs[None], self._dt
        )
        steps, past = round(AHEAD / self._dt), round(HISTORY / self._dt)
        first = np.arange(past, len(inputs) - steps, steps)
        self._q, self._dq = q[0, first], dq[0, first]
        self._inputs = np.stack([inputs[i : i + steps] for i in first])
        before = [(q[0, i - past : i], dq[0, i - past : i], inputs[i - past : i]) for i in first]
        states, rates, held = (np.stack(part) for part in zip(*before, strict=True))
        self._history = (states, rates, held, None, np.full(held.shape[:2], self._dt))
        self._ideal = self._end(Model(robot), self._q, self._dq)
        self._floor = self._noise_floor(Model(robot), noise)

    def size(self, placed: Placed) -> Array:
        """Rms change at 0.5 s over the floor, mean over the states, per leading amplitude."""
        with np.errstate(all='ignore'):
            change = self._end(Model(self.robot, (placed,)), self._q, self._dq) - self._ideal
        return np.atleast_1d(np.sqrt(((change / self._floor) ** 2).mean(axis=(-2, -1))))

    def _noise_floor(self, model: Model, noise: tuple[float, float]) -> Array:
        """Rms error of a perfect model that starts from a noisy state, per state."""
        joints = self._q.shape[-1]
        sigma = np.repeat(noise, joints)
        variance = np.broadcast_to(sigma**2, self._ideal.shape).copy()
        for i, move in enumerate(1e-5 * np.eye(2 * joints)):
            moved = self._end(model, self._q + move[:joints], self._dq + move[joints:])
            variance += ((moved - self._ideal) / 1e-5 * sigma[i]) ** 2
        return np.sqrt(variance.mean(axis=0))

    def _end(self, model: Model, q: Array, dq: Array) -> Array:
        angles, rates = rollout(model, q, dq, self._inputs, self._dt, history=self._history)
        return np.concatenate([angles[..., -1, :], rates[..., -1, :]], axis=-1)


def _log_uniform(rng: np.random.Generator, limits: tuple[float, float]) -> float:
    return float(np.exp(rng.uniform(*np.log(limits))))
