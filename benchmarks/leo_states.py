# SPDX-License-Identifier: Apache-2.0
"""States of LEO under random voltages: airborne, in stance, landing in the next step."""

from typing import NamedTuple

import numpy as np

from leo_sim.dynamics.substep import Period, substeps
from leo_sim.model import Model

FEET = slice(0, 4)
CLEAR = 1e-4  # m


class States(NamedTuple):
    """Angles and rates (N, 9), the voltages held over the next control step (N, 6)."""

    q: np.ndarray
    dq: np.ndarray
    volts: np.ndarray


def moved(model: Model, states: States, dt: float) -> tuple[np.ndarray, np.ndarray]:
    """Angles and rates after dt s."""
    count = substeps(dt, model.integration_step)
    period = Period(states.volts, None, dt / count, count)
    q, dq, _ = model.integrate(model.laws, model.rigid, states.q, states.dq, {}, period)
    return q, dq


def heights(model: Model, q: np.ndarray) -> np.ndarray:
    """Of all spheres over the ground, m, (N, P)."""
    return model.spheres.touch(q, q, q.shape[:-1]).over


def sampled(model: Model, each: int, seed: int = 0, robots: int = 300) -> dict[str, States]:
    """`each` states of every kind, met by robots that fall and stagger under random voltages."""
    rng = np.random.default_rng(seed)
    found: dict[str, list[States]] = {'airborne': [], 'stance': [], 'touch-down': []}
    while min(sum(len(s.q) for s in part) for part in found.values()) < each:
        states = _dropped(model, robots, rng)
        for _ in range(30):
            noise = rng.normal(0, 2.5, states.volts.shape)
            states = states._replace(volts=np.clip(0.85 * states.volts + noise, -8.6, 8.6))
            states = _sorted_in(model, states, found)
    joined = {
        kind: States(*map(np.concatenate, zip(*part, strict=True))) for kind, part in found.items()
    }
    return {kind: _drawn(states, each, rng) for kind, states in joined.items()}


def _drawn(states: States, each: int, rng: np.random.Generator) -> States:
    chosen = rng.permutation(len(states.q))[:each]
    return States(*(a[chosen] for a in states))


def _dropped(model: Model, count: int, rng: np.random.Generator) -> States:
    """Robots near the nominal pose, half of them on the ground, half up to 0.12 m above."""
    q = np.tile(model.start('nominal').q, (count, 1))
    q[:, 2] += rng.uniform(-0.2, 0.2, count)
    q[:, 3:5] += rng.uniform(-0.4, 0.4, (count, 2))
    q[:, 5:7] = np.minimum(q[:, 5:7] - rng.uniform(0, 0.6, (count, 2)), 0.0)
    q[:, 7:] += rng.uniform(-0.3, 0.3, (count, 2))
    lift = np.where(rng.uniform(size=count) < 0.5, 0.0, rng.uniform(0, 0.12, count))
    q[:, 1] += 0.0005 - heights(model, q).min(axis=-1) + lift
    dq = rng.normal(0, 1, q.shape) * [0.3, 0.2, 0.5, 1, 1, 1, 1, 1, 1]
    return States(q, dq, rng.uniform(-8, 8, (count, 6)))


def _sorted_in(model: Model, states: States, found: dict[str, list[States]]) -> States:
    """The states one control step later; those of now are filed by what happens in it."""
    now, over = states, [heights(model, states.q)]
    for _ in range(10):
        now = States(*moved(model, now, 0.003), states.volts)
        over.append(heights(model, now.q))
    track = np.array(over)
    up = (np.abs(states.q[:, 2]) < 1) & (track[..., 4:].min(axis=(0, 2)) > 0.001)
    feet = track[..., FEET]
    lands = ((feet[0] > CLEAR) & (feet.min(axis=0) < 0)).any(axis=-1)
    kinds = {
        'airborne': feet.min(axis=(0, 2)) > CLEAR,
        'touch-down': lands,
        'stance': (feet[0] < 0).any(axis=-1) & ~lands,
    }
    for kind, there in kinds.items():
        found[kind].append(States(*(a[there & up] for a in states)))
    return now


def stepping(model: Model, volts: float, seed: int = 0, robots: int = 200) -> States:
    """States of robots whose legs are driven in turn, from the nominal pose until they fall."""
    rng, start = np.random.default_rng(seed), model.start('nominal')
    q = np.tile(start.q, (robots, 1))
    q[:, 3:] += rng.uniform(-0.08, 0.08, (robots, 6))
    q[:, 5:7] = np.minimum(q[:, 5:7], 0.0)
    cycle, phase = rng.uniform(1, 2.5, (robots, 1)), rng.uniform(0, 2 * np.pi, (robots, 3))
    shift = np.repeat(phase, 2, axis=1) + np.pi * np.tile([0, 1], 3)
    now, met = States(q, np.zeros_like(q), np.zeros((robots, 6))), []
    for k in range(40):
        wave = np.sign(np.sin(2 * np.pi * cycle * 0.03 * k + shift))
        now = now._replace(volts=volts * wave)
        up = (np.abs(now.q[:, 2]) < 1) & (heights(model, now.q)[:, FEET.stop :].min(axis=-1) > 0)
        now = States(*(a[up] for a in now))
        cycle, shift = cycle[up], shift[up]
        met.append(now)
        now = States(*moved(model, now, 0.03), now.volts)
    return States(*map(np.concatenate, zip(*met, strict=True)))
