# SPDX-License-Identifier: Apache-2.0
"""The torque a model leaves over along a recording, by inverse dynamics of the smoothed angles."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from scipy.optimize import least_squares
from scipy.signal import savgol_filter

from leo_diffmodel.bags.recording import Episode, Recording
from leo_diffmodel.compare.windows import sample_period
from leo_sim.model import Model

HALF_SECONDS, ORDER = 0.07, 4
STILL = 0.05  # rad/s


def residual(model: Model, recording: Recording) -> np.ndarray:
    """Torque that the motion takes less what the model's motors and losses give [N m], (T, J).

    Angles and inputs are smoothed alike (Savitzky-Golay, 0.14 s, order 4); rates and
    accelerations are those of the smoothed angles. Where a joint hardly moves, dry friction
    takes whatever it can hold.
    """
    return np.concatenate(
        [_episode(model, e, sample_period([recording])) for e in recording.episodes]
    )


def refitted_by_torque(model: Model, recordings: Sequence[Recording]) -> Model:
    """`model` with its uncertain constants where the torque residual is least, as usual."""
    free = {path: c for path, c in model.robot.constants.items() if c.uncertain}

    def with_values(values: np.ndarray) -> Model:
        found = dict(zip(free, map(float, values), strict=True))
        return model.changed(constants={**model.constants, **found})

    def left(values: np.ndarray) -> np.ndarray:
        changed = with_values(values)
        return np.concatenate([residual(changed, run).ravel() for run in recordings])

    low, high = zip(*(c.uncertain for c in free.values()), strict=True)
    start = [float(model.constants[path]) for path in free]
    return with_values(least_squares(left, start, bounds=(low, high), x_scale='jac').x)


def _episode(model: Model, episode: Episode, period: float) -> np.ndarray:
    window = 2 * round(HALF_SECONDS / period) + 1
    q, dq, ddq = (
        savgol_filter(episode.q, window, ORDER, deriv=n, delta=period, axis=0) for n in range(3)
    )
    q, dq = model.laws.true_state(q, dq)
    u = savgol_filter(_at_motors(model, episode), window, ORDER, axis=0)
    inside = slice(window, -window)
    return _left(model, *(x[inside] for x in (q, dq, ddq, u)))


def _at_motors(model: Model, episode: Episode) -> np.ndarray:
    """What the command effects make of the inputs, shape (T, A)."""
    if all(placed.effect.hook != 'command' for placed in model.effects):
        return episode.inputs
    memory, out = {}, []
    for u, h in zip(
        episode.inputs, np.diff(episode.t, append=2 * episode.t[-1] - episode.t[-2]), strict=True
    ):
        reached, _, memory = model.laws.command(u[None], None, memory, float(h))
        out.append(reached[0])
    return np.array(out)


def _left(
    model: Model, q: np.ndarray, dq: np.ndarray, ddq: np.ndarray, u: np.ndarray
) -> np.ndarray:
    mass, bias = model.rigid.mass_and_bias(q, dq)
    needed = (mass @ ddq[..., None])[..., 0] + bias + model.laws.rotor_inertia * ddq
    load = model.rigid.load(q) if model.laws.needs_load else None
    given = model.laws.torques(q, dq, dq, u, None, load)
    left = needed - given.motor - given.joint
    if given.level is None:
        return left
    moving = left + given.level * np.sign(dq)
    return np.where(np.abs(dq) > STILL, moving, left - np.clip(left, -given.level, given.level))
