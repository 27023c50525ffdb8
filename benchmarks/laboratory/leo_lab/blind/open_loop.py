# SPDX-License-Identifier: Apache-2.0
"""How large an effect is in a run: short open loops along it, beside the noise floor."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np
from scipy.optimize import least_squares

from leo_diffmodel.compare.sizes import reach, torque_scale
from leo_diffmodel.explain.problem.hypothesis import Candidate
from leo_lab.blind.scenes import Effects, Given, Path, Scene
from leo_msgs_py.errors import UserError
from leo_sim.description.robot import Robot
from leo_sim.effects import place, Placed
from leo_sim.model import Model
from leo_sim.model.batch import rollout
from leo_sim.truth.drawing import of_size

Array = np.ndarray
AHEAD, HISTORY = 0.5, 0.15  # s
AHEAD_ON_GROUND, APART_ON_GROUND = 0.3, 0.6  # s; a walker's take long
ROUNDS, TOLERANCE = 6, 0.15
LEFT, LEFT_OF_SIZE = 0.15, 0.7
"""Of a change, and of a size, that constants must leave when they are refitted."""
REFITS, AWAY = 10, 1e6
MOST_TIMES = 10.0
"""How much more than in a wider law a parameter may be in a narrower one."""
STILL = 0.3
NUDGE = 0.01
"""Of the range of a constant: less is lost between the counts of a servo."""


@dataclass(frozen=True)
class Run:
    """A robot and what it does.

    Attributes:
        robot: the robot, with its true constants.
        scenes: what drives it, one after the other.
        noise: standard deviation of angle [rad] and rate [rad/s].
    """

    robot: Robot
    scenes: tuple[Scene, ...]
    noise: tuple[float, float]

    @property
    def ever_free(self) -> bool:
        """Whether the motors are off at times."""
        return any(isinstance(s, Given) and not s.enabled.all() for s in self.scenes)

    @property
    def seconds(self) -> float:
        """How long it takes."""
        return sum(s.count for s in self.scenes) * self.robot.control_period

    def paths(self, effects: Effects) -> list[Path]:
        """Where the robot comes by with effects."""
        return [p for s in self.scenes for p in s.paths(self.robot, effects, self.noise)]


class Ahead(NamedTuple):
    """Open loops of equal length along some paths, as `rollout` takes them; (W, ...) each."""

    q: Array
    dq: Array
    inputs: Array
    enabled: Array
    held: Array
    start: Array
    history: tuple[Array, ...]


def ahead(paths: list[Path], seconds: float, apart: float, dt: float) -> Ahead:
    """A loop of so many seconds after every `apart`; what went before each is its history."""
    pieces = [p for p in (_along(path, seconds, apart, dt) for path in paths) if len(p.q)]
    q, dq, inputs, enabled, held, start = (
        np.concatenate(column) for column in zip(*(p[:6] for p in pieces), strict=True)
    )
    before = zip(*(p.history for p in pieces), strict=True)
    history = tuple(np.concatenate(column) for column in before)
    return Ahead(q, dq, inputs, enabled, held, start, history)


def _along(path: Path, seconds: float, apart: float, dt: float) -> Ahead:
    steps, past = round(seconds / dt), round(HISTORY / dt)
    first = np.arange(past, len(path.inputs) - steps, round(apart / dt))
    then, before = first[:, None] + np.arange(steps), first[:, None] + np.arange(-past, 0)
    history = (
        path.q[before],
        path.dq[before],
        path.inputs[before],
        path.enabled[before],
        np.full(before.shape, dt),
    )
    return Ahead(
        path.q[first],
        path.dq[first],
        path.inputs[then],
        path.enabled[then],
        np.full(len(first), path.held),
        path.since + first * dt,
        history,
    )


class OpenLoop:
    """Open loops along the run of a robot that has some effects.

    Attributes:
        robot: the robot.
        rates: root mean square of its joint rates along the run [rad/s], shape (J,).
    """

    def __init__(self, run: Run, along: Effects, others: Effects = ()) -> None:
        """Run the robot with the effects `along`; sizes are changes on top of `others`."""
        self.robot, self._others = run.robot, others
        self._on_ground = bool(run.robot.contacts)
        far, apart = (AHEAD_ON_GROUND, APART_ON_GROUND) if self._on_ground else (AHEAD, AHEAD)
        paths = run.paths(along)
        self.rates = _rms(np.concatenate([p.dq for p in paths]).T)
        self._ahead = ahead(paths, far, apart, run.robot.control_period)
        self._ideal = self._end(self._model(others))
        self._floor = self._noise_floor(self._model(others), run.noise)
        self._tuned = self._by_constants()

    def size(self, placed: Placed) -> Array:
        """Rms change at the end over the floor, mean over the states, per leading amplitude.

        Less what a change of the robot's uncertain constants explains.
        """
        change = self._change(placed)
        with np.errstate(all='ignore'):
            return _rms(change - (change @ self._tuned) @ self._tuned.T)

    def shows(self, placed: Placed) -> bool:
        """Whether refitted constants leave a good part of the effect, and nearly its size."""
        change, size = float(_rms(self._change(placed))[0]), float(self.size(placed)[0])
        return self.left(placed) > max(LEFT * change, LEFT_OF_SIZE * size)

    def left(self, placed: Placed) -> float:
        """Rms change at the end over the floor, less what the uncertain constants can explain.

        `size` is linear in the constants; here they are refitted within their ranges. Nothing is
        left where the effect sends the robot away.
        """
        change = self._change(placed)[0]
        uncertain = [c for c in self.robot.constants.values() if c.uncertain]
        if not np.isfinite(change).all():
            return 0.0
        if not uncertain:
            return float(_rms(change))
        low, high = np.array([c.uncertain for c in uncertain]).T
        paths, span = [c.path for c in uncertain], high - low

        def by(shares: Array) -> Array:
            return self._by_values(dict(zip(paths, (low + shares * span).tolist(), strict=True)))

        start = (np.array([c.value for c in uncertain]) - low) / span
        return _least(change, by, start, 1.0)

    def beyond(self, placed: Placed, law: Candidate) -> float:
        """Rms change at the end over the floor that no parameters of another law make.

        They begin where those of the same name are: a law in which the other one is.
        """
        names = [p.name for p in law.parameters]
        values = np.array([float(np.mean(placed.parameters[name])) for name in names])

        def by(times: Array) -> Array:
            found = dict(zip(names, (times * values).tolist(), strict=True))
            return self._change(place(self.robot, law.effect.name, law.where, **found))[0]

        return _least(self._change(placed)[0], by, np.ones(len(names)), MOST_TIMES)

    def _by_values(self, values: Mapping[str, float]) -> Array:
        """Change at the end in noise floors that other constants make, shape (W 2J,)."""
        end = self._end(self._model(self._others, values))
        return ((end - self._ideal) / self._floor).ravel()

    def _change(self, placed: Placed) -> Array:
        """Change at the end in noise floors, shape (S, W 2J)."""
        with np.errstate(all='ignore'):
            end = self._end(self._model((*self._others, placed)))
            change = (end - self._ideal) / self._floor
            change = np.where(np.isfinite(change), change, np.inf)
        return change.reshape(-1, self._ideal.size)

    def _by_constants(self) -> Array:
        """Orthonormal changes that the uncertain constants make, shape (W 2J, C)."""
        columns = [
            self._by_values({c.path: c.value + NUDGE * np.ptp(c.uncertain)})
            for c in self.robot.constants.values()
            if c.uncertain
        ]
        if not columns:
            return np.zeros((self._ideal.size, 0))
        scaled = np.stack([c / max(np.linalg.norm(c), 1e-300) for c in columns], axis=-1)
        return np.linalg.qr(scaled)[0]

    def _noise_floor(self, model: Model, noise: tuple[float, float]) -> Array:
        """Rms error of a perfect model that starts from a noisy state, per state.

        On the ground also per loop: where a foot lands, noise alone moves the end far.
        """
        joints = self._ahead.q.shape[-1]
        sigma = np.repeat(noise, joints)
        variance = np.broadcast_to(sigma**2, self._ideal.shape).copy()
        for move in np.diag(sigma):
            variance += (self._end(model, move) - self._ideal) ** 2
        return np.sqrt(variance if self._on_ground else variance.mean(axis=0))

    def _end(self, model: Model, move: Array | float = 0.0) -> Array:
        """States at the end of every window that starts `move` beside the run."""
        at = self._ahead
        start = np.concatenate([at.q, at.dq], axis=-1) + move
        q, dq = np.split(start, 2, axis=-1)
        angles, rates = rollout(
            model,
            q,
            dq,
            at.inputs,
            self.robot.control_period,
            enabled=at.enabled,
            history=at.history,
            start=at.start,
            held=at.held if self._on_ground else None,
        )
        return np.concatenate([angles[..., -1, :], rates[..., -1, :]], axis=-1)

    def _model(self, effects: Effects, constants: Mapping[str, float] | None = None) -> Model:
        return Model(
            self.robot, effects, constants, scheme='search' if self._on_ground else 'reference'
        )


def sized(
    run: Run, first: OpenLoop, others: Effects, name: str, where: str, size: float, seed: int
) -> tuple[Placed, float] | None:
    """The effect with the wanted size in the run that it itself causes; None where it has none.

    The run depends on the effect, and its size on the run: a few rounds settle both.

    Args:
        run: the robot and its drive.
        first: open loops along the run without the effect.
        others: effects that are there as well.
        name: of the effect.
        where: a joint, a link or 'all'.
        size: rms change in noise floors.
        seed: of signs, directions and angles.
    """
    placed: Placed | None = None
    loop = first
    for _ in range(ROUNDS):
        if placed is not None:
            try:
                loop = OpenLoop(run, (*others, placed), others)
            except UserError:  # it sends the robot away
                return None
            reached = float(loop.size(placed)[0])
            if abs(np.log(reached / size)) < TOLERANCE:
                likely = _moves(loop, first, placed) and _within(loop, placed)
                return (placed, reached) if likely and loop.shows(placed) else None
        placed = of_size(loop, name, where, size, np.random.default_rng(seed))
        if placed is None or not loop.shows(placed):
            return None
    return None


def _moves(loop: OpenLoop, first: OpenLoop, placed: Placed) -> bool:
    """Whether no joint of a walker is stopped by what was added: it would show in nothing.

    A torque more than the motor's own locks its joint as any other would.
    """
    if not loop.robot.contacts:
        return True
    torques = _of_unit(placed, loop.robot, 'N m')
    weak = all(abs(float(t)) < torque_scale(loop.robot) for t in torques)
    return weak and bool(np.all(loop.rates > STILL * first.rates))


def _within(loop: OpenLoop, placed: Placed) -> bool:
    """Whether no link of a walker has its mass farther off than the whole robot reaches."""
    if not loop.robot.contacts:
        return True
    lengths = _of_unit(placed, loop.robot, 'm')
    return all(abs(float(length)) < reach(loop.robot) for length in lengths)


def _of_unit(placed: Placed, robot: Robot, unit: str) -> list[Any]:
    parameters = placed.effect.parameters_for(robot, placed.where)
    return [placed.parameters[p.name] for p in parameters if p.unit == unit]


def _least(change: Array, by: Callable[[Array], Array], start: Array, most: float) -> float:
    """Rms of a change that parameters between 0 and `most` leave of it at least."""

    def rest(parameters: Array) -> Array:
        left = (change - by(parameters)) / np.sqrt(change.size)
        return np.nan_to_num(left, nan=AWAY, posinf=AWAY, neginf=-AWAY)

    best = least_squares(rest, start, bounds=(0.0, most), diff_step=NUDGE, max_nfev=REFITS)
    return float(np.sqrt(2.0 * best.cost))


def _rms(change: Array) -> Array:
    with np.errstate(over='ignore', invalid='ignore'):
        return np.sqrt((change**2).mean(axis=-1))
