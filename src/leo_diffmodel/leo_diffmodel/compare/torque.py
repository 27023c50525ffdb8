# SPDX-License-Identifier: Apache-2.0
"""The torque the model lacks at each joint and instant."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from leo_diffmodel.bags.recording import Recording
from leo_diffmodel.compare.errors import has_memory
from leo_diffmodel.compare.noise import HISTORY, per_window
from leo_diffmodel.compare.pushes import respond
from leo_diffmodel.compare.sizes import torque_scale
from leo_diffmodel.compare.windows import cut, sample_period, Windows
from leo_sim.model import Model

Array = np.ndarray
INTERVALS = 5
SHORTEST = 0.05
WEAK = 1e-6
"""Weight of the assumption that what is missing is no larger than the robot's own torque."""


@dataclass(frozen=True)
class MissingTorque:
    """Missing torque by least squares over short windows, each with a free start state.

    Attributes:
        time: middle of each window [s], shape (W,).
        torque: constant torque that the model lacks there [N m], shape (W, J).
        spread: its standard deviation from measurement noise [N m], shape (W, J).
        q: mean joint angle [rad], shape (W, J).
        dq: mean joint rate [rad/s], shape (W, J).
        inputs: mean input [V or N m], shape (W, A).
        windows: the short windows.
    """

    time: Array
    torque: Array
    spread: Array
    q: Array
    dq: Array
    inputs: Array
    windows: Windows

    def take(self, index: Array) -> MissingTorque:
        """Return the estimates of the windows `index`."""
        arrays = {name: value[index] for name, value in vars(self).items() if name != 'windows'}
        return MissingTorque(windows=self.windows.take(index), **arrays)


def missing_torque(recordings: Sequence[Recording], model: Model, sigma: Array) -> MissingTorque:
    """Estimate the missing torque over short windows.

    Windows in which no torque would show are left out (a joint that dry friction holds still),
    unless there are no others.
    """
    history = HISTORY if has_memory(model) else 0.0
    windows = cut(recordings, window_seconds(recordings), history=history)
    found = estimate(model, windows, sigma)
    return found.take(telling(found, model))


def telling(found: MissingTorque, model: Model) -> Array:
    """Indices of the windows in which a torque would show; all of them where none does."""
    told = np.all(found.spread < 0.1 * torque_scale(model.robot), axis=1)
    return np.flatnonzero(told if told.any() else ~told)


def window_seconds(recordings: Sequence[Recording]) -> float:
    """Five samples, or 0.05 s where samples are closer: less would show little but noise [s]."""
    return max(INTERVALS * sample_period(recordings), SHORTEST)


def estimate(model: Model, windows: Windows, sigma: Array) -> MissingTorque:
    """Least squares for a constant torque per window and joint, with a free start state.

    Args:
        model: the model that lacks the torque; positive turns the joint forward.
        windows: short windows.
        sigma: noise of each recording and channel, shape (R, 2J).
    """
    joints = windows.q.shape[-1]
    unit = 1e-3 * torque_scale(model.robot)
    flat = np.broadcast_to(np.eye(joints)[:, None, None], (joints, *windows.dt.shape, joints))
    predicted, columns = respond(model, windows, windows.measured[:, 0], unit * flat)
    noise = per_window(sigma, windows)
    e = ((windows.measured - predicted) / noise).reshape(windows.count, -1, 1)
    a = (columns / noise[..., None]).reshape(windows.count, e.shape[1], -1)
    inverse = np.linalg.inv(np.swapaxes(a, -1, -2) @ a + WEAK * np.eye(a.shape[-1]))
    found = (inverse @ (np.swapaxes(a, -1, -2) @ e))[..., 0]
    variance = np.diagonal(inverse, axis1=-2, axis2=-1)
    return MissingTorque(
        time=windows.start + 0.5 * windows.dt.sum(axis=1),
        torque=unit * found[:, -joints:],
        spread=unit * np.sqrt(variance[:, -joints:]),
        q=windows.q.mean(axis=1),
        dq=windows.dq.mean(axis=1),
        inputs=windows.inputs.mean(axis=1),
        windows=windows,
    )

