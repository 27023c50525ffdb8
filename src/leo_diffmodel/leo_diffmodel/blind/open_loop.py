# SPDX-License-Identifier: Apache-2.0
"""How large an effect is in a run: half-second open loops along it, beside the noise floor."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from leo_sim.batch import rollout
from leo_sim.drawing import of_size
from leo_sim.effects import Placed
from leo_sim.model import Model
from leo_sim.robot import Robot

Array = np.ndarray
Effects = tuple[Placed, ...]
AHEAD, HISTORY = 0.5, 0.15
ROUNDS, TOLERANCE = 6, 0.15
LEFT, REFITS = 0.15, 4
NUDGE = 1e-5


@dataclass(frozen=True)
class Run:
    """A robot and what drives it.

    Attributes:
        robot: the robot, with its true constants.
        inputs: of each control period [V or N m], shape (N, A).
        enabled: motors on, shape (N, A).
        noise: standard deviation of angle [rad] and rate [rad/s].
    """

    robot: Robot
    inputs: Array
    enabled: Array
    noise: tuple[float, float]


class OpenLoop:
    """Half-second open loops along the run of a robot that has some effects.

    Attributes:
        robot: the robot.
    """

    def __init__(self, run: Run, along: Effects, others: Effects = ()) -> None:
        """Run the robot with the effects `along`; sizes are changes on top of `others`."""
        self.robot, self._dt, self._others = run.robot, run.robot.control_period, others
        start = Model(run.robot).start('nominal')
        q, dq = rollout(Model(run.robot, along), start.q[None], start.dq[None], run.inputs[None],
                        self._dt, run.enabled[None])  # fmt: skip
        steps, past = round(AHEAD / self._dt), round(HISTORY / self._dt)
        first = np.arange(past, len(run.inputs) - steps, steps)
        ahead, before = first[:, None] + np.arange(steps), first[:, None] + np.arange(-past, 0)
        self._q, self._dq, self._start = q[0, first], dq[0, first], first * self._dt
        self._inputs, self._enabled = run.inputs[ahead], run.enabled[ahead]
        self._history = (q[0, before], dq[0, before], run.inputs[before], run.enabled[before],
                         np.full(before.shape, self._dt))  # fmt: skip
        self._ideal = self._end(Model(self.robot, others))
        self._floor = self._noise_floor(Model(self.robot, others), run.noise)
        self._tuned = self._by_constants()

    def size(self, placed: Placed) -> Array:
        """Rms change at 0.5 s over the floor, mean over the states, per leading amplitude.

        Less what a change of the robot's uncertain constants explains.
        """
        change = self._change(placed)
        with np.errstate(all='ignore'):
            return _rms(change - (change @ self._tuned) @ self._tuned.T)

    def shows(self, placed: Placed) -> bool:
        """Whether refitted constants leave more than a small part of the effect."""
        change = self._change(placed)
        return bool(_rms(self._refitted(change))[0] > LEFT * _rms(change)[0])

    def _refitted(self, change: Array) -> Array:
        """What is left of a change, (1, W 2J), with the uncertain constants fitted to it."""
        ranges = {c.path: c.uncertain for c in self.robot.constants.values() if c.uncertain}
        values = {path: self.robot.constants[path].value for path in ranges}
        rest = change
        for _ in range(REFITS if values else 0):
            now = self._by_values(values)
            nudges = {path: NUDGE * np.ptp(limits) for path, limits in ranges.items()}
            columns = [(self._by_values({**values, path: values[path] + nudge}) - now) / nudge
                       for path, nudge in nudges.items()]  # fmt: skip
            step = np.linalg.lstsq(np.stack(columns, axis=-1), change[0] - now, rcond=None)[0]
            values = {path: float(np.clip(values[path] + moved, *ranges[path]))
                      for path, moved in zip(ranges, step, strict=True)}  # fmt: skip
            rest = change - self._by_values(values)
        return rest

    def _by_values(self, values: Mapping[str, float]) -> Array:
        """Change at 0.5 s in noise floors that other constants make, shape (W 2J,)."""
        end = self._end(Model(self.robot, self._others, values))
        return ((end - self._ideal) / self._floor).ravel()

    def _change(self, placed: Placed) -> Array:
        """Change at 0.5 s in noise floors, shape (S, W 2J)."""
        with np.errstate(all='ignore'):
            end = self._end(Model(self.robot, (*self._others, placed)))
            change = (end - self._ideal) / self._floor
            change = np.where(np.isfinite(change), change, np.inf)
        return change.reshape(-1, self._ideal.size)

    def _by_constants(self) -> Array:
        """Orthonormal changes that the uncertain constants make, shape (W 2J, C)."""
        columns = [self._by_values({c.path: c.value + NUDGE * np.ptp(c.uncertain)})
                   for c in self.robot.constants.values() if c.uncertain]  # fmt: skip
        if not columns:
            return np.zeros((self._ideal.size, 0))
        scaled = np.stack([c / max(np.linalg.norm(c), 1e-300) for c in columns], axis=-1)
        return np.linalg.qr(scaled)[0]

    def _noise_floor(self, model: Model, noise: tuple[float, float]) -> Array:
        """Rms error of a perfect model that starts from a noisy state, per state."""
        joints = self._q.shape[-1]
        sigma = np.repeat(noise, joints)
        variance = np.broadcast_to(sigma**2, self._ideal.shape).copy()
        for i, move in enumerate(NUDGE * np.eye(2 * joints)):
            moved = self._end(model, move)
            variance += ((moved - self._ideal) / NUDGE * sigma[i]) ** 2
        return np.sqrt(variance.mean(axis=0))

    def _end(self, model: Model, move: Array | float = 0.0) -> Array:
        """States at the end of every window that starts `move` beside the run."""
        start = np.concatenate([self._q, self._dq], axis=-1) + move
        q, dq = np.split(start, 2, axis=-1)
        angles, rates = rollout(model, q, dq, self._inputs, self._dt, enabled=self._enabled,
                                history=self._history, start=self._start)  # fmt: skip
        return np.concatenate([angles[..., -1, :], rates[..., -1, :]], axis=-1)


def sized(
    run: Run, others: Effects, name: str, where: str, size: float, seed: int
) -> tuple[Placed, float] | None:
    """The effect with the wanted size in the run that it itself causes; None where it has none.

    The run depends on the effect, and its size on the run: a few rounds settle both.

    Args:
        run: the robot and its drive.
        others: effects that are there as well.
        name: of the effect.
        where: a joint, a link or 'all'.
        size: rms change in noise floors.
        seed: of signs, directions and angles.
    """
    placed: Placed | None = None
    for _ in range(ROUNDS):
        loop = OpenLoop(run, others if placed is None else (*others, placed), others)
        if placed is not None:
            reached = float(loop.size(placed)[0])
            if abs(np.log(reached / size)) < TOLERANCE:
                return (placed, reached) if loop.shows(placed) else None
        placed = of_size(loop, name, where, size, np.random.default_rng(seed))
        if placed is None or not loop.shows(placed):
            return None
    return None


def _rms(change: Array) -> Array:
    with np.errstate(over='ignore', invalid='ignore'):
        return np.sqrt((change**2).mean(axis=-1))
