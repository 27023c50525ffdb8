# SPDX-License-Identifier: Apache-2.0
"""Recordings of robots with one joint that something else than their motor moves."""

from dataclasses import replace

import numpy as np
from tests.simulate import DT, NOISE, record

from leo_diffmodel.bags.recording import Recording
from leo_diffmodel.compare.sizes import gravity_scale
from leo_sim.description.robot import Robot
from leo_sim.model import Model

SECONDS = 20.0


def shove(robot: Robot, *begins: float, size: float = 0.8) -> np.ndarray:
    """Half-sines of 0.15 s at the joint [N m], shape (N, 1)."""
    t = DT * np.arange(round(SECONDS / DT))
    waves = [
        np.where((t >= b) & (t < b + 0.15), np.sin(np.pi * (t - b) / 0.15), 0) for b in begins
    ]
    return size * gravity_scale(robot) * np.sum(waves, axis=0)[:, None]


def led(robot: Robot, seed: int, held: bool = False) -> Recording:
    """A joint that a hand leads along a smooth path; the motor is off, or holds against it."""
    rng, t = np.random.default_rng(seed), DT * np.arange(round(SECONDS / DT))
    waves = [
        rng.normal() * np.sin(2 * np.pi * rng.uniform(0.1, 0.5) * t + rng.uniform(0, 6))
        for _ in range(6)
    ]
    way = 0.4 * np.sum(waves, axis=0)[:, None]
    q = Model(robot).start('nominal').q + way
    dq = np.gradient(q, DT, axis=0)
    inputs = np.clip(-0.5 * way, -1, 1) * robot.limits * held
    noisy = [x + rng.normal(0, n, x.shape) for x, n in zip((q, dq), NOISE, strict=True)]
    return spoilt(
        record(robot, seconds=SECONDS),
        q=noisy[0],
        dq=noisy[1],
        inputs=inputs,
        enabled=np.full(q.shape, held),
    )


def carried(robot: Robot, seed: int, share: float) -> Recording:
    """A joint that a hand leads while its motor carries that share of its weight, or more."""
    recording = led(robot, seed)
    (e,) = recording.episodes
    inputs = np.clip(-share * Model(robot).rigid.load(e.q), -robot.limits, robot.limits)
    return spoilt(recording, inputs=inputs, enabled=np.full(e.q.shape, True))


def spoilt(recording: Recording, **changes: np.ndarray) -> Recording:
    (episode,) = recording.episodes
    return replace(recording, episodes=(replace(episode, **changes),))
