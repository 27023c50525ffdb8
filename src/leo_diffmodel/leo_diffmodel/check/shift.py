# SPDX-License-Identifier: Apache-2.0
"""How well the data agree with inputs that act earlier or later than their stamps say."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from leo_diffmodel.bags.mend import with_inputs_late
from leo_diffmodel.bags.recording import Recording
from leo_diffmodel.compare.noise import HISTORY, spread_out
from leo_diffmodel.compare.pushes import respond
from leo_diffmodel.compare.sizes import torque_scale
from leo_diffmodel.compare.windows import cut, sample_period, Windows
from leo_diffmodel.explain.problem.likelihood import huber, huber_weight
from leo_diffmodel.explain.settings import SETTINGS
from leo_sim.model import Model

Array = np.ndarray
INTERVALS = 12
MOST_WINDOWS, MOST_ON_GROUND = 80, 30
"""The second of a robot with contacts, where a window is expensive."""


def shifted(recording: Recording, seconds: float) -> Recording:
    """The recording with its inputs acting `seconds` later (earlier where negative)."""
    late = [seconds] * len(recording.actuators)
    episodes = tuple(with_inputs_late(e, late) for e in recording.episodes)
    return replace(recording, episodes=episodes)


def misfit(recording: Recording, model: Model, sigma: Array) -> tuple[Array, Array]:
    """Robust loss of short windows with free start states and free missing torques.

    Torques that are constant, that grow in time and that go along with the input are free at
    each joint, so that what the model lacks does not pass for an input at the wrong time.

    Args:
        recording: the bag.
        model: its model, good or not.
        sigma: noise of angles and rates, shape (2J,).

    Returns:
        start time of each window [s], shape (W,), and its loss [nats], shape (W,).
    """
    windows = short(recording, model)
    predicted, columns = respond(model, windows, windows.measured[:, 0], _torques(model, windows))
    e = ((windows.measured - predicted) / sigma).reshape(windows.count, -1)
    a = (columns / sigma[:, None]).reshape(windows.count, e.shape[1], -1)
    return windows.start, huber(_without(e, a), SETTINGS.numerics.huber)


def short(recording: Recording, model: Model) -> Windows:
    """Windows of twelve intervals, some of them evenly chosen."""
    windows = cut([recording], INTERVALS * sample_period([recording]), history=HISTORY)
    return spread_out(windows, MOST_ON_GROUND if model.robot.contacts else MOST_WINDOWS)


def _torques(model: Model, windows: Windows) -> Array:
    """Small torques at each joint: constant, a ramp, and along each input, (B, W, K, J)."""
    joints = windows.q.shape[-1]
    flat = np.ones_like(windows.dt)
    ramp = np.broadcast_to(np.linspace(-1, 1, windows.steps), flat.shape)
    size = 1e-3 * torque_scale(model.robot)
    peak = np.maximum(np.abs(windows.inputs).max(axis=(0, 1)), 1e-12)
    along = np.moveaxis(windows.inputs / peak, -1, 0)
    free = [s[..., None] * np.eye(joints)[j] for j in range(joints) for s in (flat, ramp)]
    motors = [
        u[..., None] * np.eye(joints)[j] for u, j in zip(along, model.robot.actuated, strict=True)
    ]
    return size * np.stack([*free, *motors])


def _without(e: Array, a: Array) -> Array:
    """Residuals without what the columns explain, twice: the second time outliers weigh less."""
    weight = np.ones_like(e)
    for _ in range(2):
        root = np.sqrt(weight)
        left, size, right = np.linalg.svd(a * root[..., None], full_matrices=False)
        good = size > 1e-7 * size[..., :1]
        inverse = np.where(good, 1 / np.where(good, size, 1.0), 0.0)
        seen = (np.swapaxes(left, -1, -2) @ (e * root)[..., None])[..., 0] * inverse
        rest = e - (a @ (np.swapaxes(right, -1, -2) @ seen[..., None]))[..., 0]
        weight = huber_weight(rest, SETTINGS.numerics.huber)
    return rest
