# SPDX-License-Identifier: Apache-2.0
"""Somebody moves the robot: shoves, a hand that leads a joint, a joint that is held still."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from leo_diffmodel.compare.sizes import torque_scale
from leo_sim.description.robot import Robot
from leo_sim.model import Model

Array = np.ndarray
KINDS = ('shoves', 'hand', 'block')
SHOVES, SHOVE_SECONDS, SHOVE_SIZE = (1, 5), (0.1, 0.3), (0.3, 1.5)
"""How many, how long each [s], and how large, in the largest motor torque."""
FASTER = 20.0
"""No shove alone makes a joint faster by more than that [rad/s]."""
HAND_PIECES, HAND_SHARE = (1, 3), (0.55, 0.9)
WAVES, WAVE_SIZE, FASTEST = 3, (0.2, 0.6), (0.1, 0.9)  # rad, Hz
BLOCK_SECONDS = (2.0, 6.0)
STIFF, DAMPING = 60.0, 1.0
"""Of what holds a joint: natural frequency with its inertia [rad/s] and damping ratio."""


class Wave(NamedTuple):
    """One sine of a hand's path: size [rad], frequency [Hz] and phase [rad]."""

    size: float
    frequency: float
    phase: float


@dataclass(frozen=True)
class Push:
    """One act from outside, at one joint.

    Attributes:
        joint: its name.
        begin: since the start of the recording [s].
        seconds: how long.
        torque: at the top of a half sine [N m]; 0 where the joint is held on a path.
        path: sines about the angle where it was taken; none holds it there.
    """

    joint: str
    begin: float
    seconds: float
    torque: float = 0.0
    path: tuple[Wave, ...] = ()

    def since(self, t: float) -> float | None:
        """Time since it began [s]; None where it does not act."""
        return t - self.begin if self.begin <= t < self.begin + self.seconds else None


def draw_pushes(
    kind: str, robot: Robot, seconds: float, rng: np.random.Generator
) -> tuple[Push, ...]:
    """The pushes of a recording of so many seconds.

    Args:
        kind: of `KINDS`.
        robot: who is pushed.
        seconds: length of the recording.
        rng: draws joints, times and sizes.
    """
    joint = str(rng.choice(robot.joint_names))
    if kind == 'shoves':
        return tuple(_shove(robot, seconds, rng) for _ in range(_count(SHOVES, rng)))
    if kind == 'hand':
        return _led(joint, seconds, rng)
    length = float(rng.uniform(*BLOCK_SECONDS))
    return (Push(joint, float(rng.uniform(1.0, seconds - length - 1.0)), length),)


def _shove(robot: Robot, seconds: float, rng: np.random.Generator) -> Push:
    side, size = float(rng.choice([-1.0, 1.0])), float(rng.uniform(*SHOVE_SIZE))
    begin, length = float(rng.uniform(1.0, seconds - 1.0)), float(rng.uniform(*SHOVE_SECONDS))
    at = int(rng.integers(len(robot.joint_names)))
    most = 0.5 * np.pi * FASTER * float(inertia(Model(robot))[at]) / length
    torque = side * min(size * torque_scale(robot), most)
    return Push(robot.joint_names[at], begin, length, torque)


def _led(joint: str, seconds: float, rng: np.random.Generator) -> tuple[Push, ...]:
    """A hand that lets go for a while between its pieces."""
    pieces = _count(HAND_PIECES, rng)
    apart = (seconds - 1.0) / pieces
    return tuple(
        Push(joint, 0.5 + i * apart, float(rng.uniform(*HAND_SHARE)) * apart, path=_waves(rng))
        for i in range(pieces)
    )


def _waves(rng: np.random.Generator) -> tuple[Wave, ...]:
    return tuple(
        Wave(*(float(rng.uniform(*limits)) for limits in (WAVE_SIZE, FASTEST, (-np.pi, np.pi))))
        for _ in range(WAVES)
    )


def inertia(model: Model) -> Array:
    """Of each joint with its motor where a run starts, the others held still, (J,) [kg m2]."""
    start = model.start('nominal')
    mass = model.rigid.mass_and_bias(start.q, start.dq)[0]
    return np.diagonal(mass) + model.laws.rotor_inertia


def _count(limits: tuple[int, int], rng: np.random.Generator) -> int:
    return int(rng.integers(*limits, endpoint=True))


class Pusher:
    """Torques of all pushes along a run.

    Args:
        model: of the robot that is pushed.
        pushes: what is done to it.
    """

    def __init__(self, model: Model, pushes: Sequence[Push]) -> None:
        self._pushes, self._names = tuple(pushes), model.robot.joint_names
        self._inertia = inertia(model)
        self._taken: dict[Push, float] = {}

    def acts(self, begin: float, end: float) -> bool:
        """Whether anything is done between two times [s]."""
        return any(p.begin < end and begin < p.begin + p.seconds for p in self._pushes)

    def torque(self, t: float, q: Array, dq: Array) -> Array:
        """Torque on the links at a time [s] in a state, (J,) [N m]."""
        torque = np.zeros(len(self._names))
        for push in self._pushes:
            since = push.since(t)
            if since is not None:
                at = self._names.index(push.joint)
                torque[at] += self._one(push, since, at, float(q[at]), float(dq[at]))
        return torque

    def _one(self, push: Push, since: float, at: int, q: float, dq: float) -> float:
        if push.torque:
            return push.torque * float(np.sin(np.pi * since / push.seconds))
        taken, turned = self._taken.setdefault(push, q), float(self._inertia[at])
        angle, rate = _along(push.path, since)
        stiff, damped = turned * STIFF**2, 2 * DAMPING * turned * STIFF
        return stiff * (taken + angle - q) + damped * (rate - dq)


def _along(path: Sequence[Wave], since: float) -> tuple[float, float]:
    """How far a hand has moved [rad], and how fast it moves [rad/s]."""
    turns = [2 * np.pi * wave.frequency for wave in path]
    at = [turn * since + wave.phase for turn, wave in zip(turns, path, strict=True)]
    angle = sum(w.size * (np.sin(a) - np.sin(w.phase)) for w, a in zip(path, at, strict=True))
    rate = sum(w.size * turn * np.cos(a) for w, turn, a in zip(path, turns, at, strict=True))
    return float(angle), float(rate)
