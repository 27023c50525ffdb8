# SPDX-License-Identifier: Apache-2.0
"""Sensitivity of windows to their initial states, and to torques that the model lacks."""

from __future__ import annotations

import numpy as np

from leo_diffmodel.compare.windows import Windows
from leo_sim.model import Model
from leo_sim.model.batch import rollout

Array = np.ndarray
STATE_STEP = 1e-4
LEAST_SEEN = 1e-6
WILD = 1e9
"""A window so sensitive was started deep in the ground, and is thrown out of it."""


def predict(model: Model, windows: Windows, start: Array, push: Array | None = None) -> Array:
    """Sensed states from the start states (..., W, 2J); shape (..., W, K+1, 2J)."""
    joints = windows.q.shape[-1]
    q, dq = rollout(
        own(model, windows),
        start[..., :joints],
        start[..., joints:],
        windows.inputs,
        windows.dt,
        enabled=windows.enabled,
        history=windows.history,
        push=push,
        start=windows.start,
        held=windows.held,
    )
    return np.concatenate([q, dq], axis=-1)


def own(model: Model, windows: Windows, instants: bool = False) -> Model:
    """The model with the constants of each window's own recording.

    For states (..., W, J), or (W, K, J) of several instants in each window.
    """
    source = windows.source[:, None] if instants else windows.source
    return model.of_recordings(windows.recordings, source)


def respond(model: Model, windows: Windows, start: Array, torques: Array) -> tuple[Array, Array]:
    """Predicted states and their sensitivities, by finite differences in one rollout.

    Args:
        model: the model.
        windows: W windows of K intervals.
        start: start states, shape (W, 2J).
        torques: small extra joint torques [N m], shape (B, W, K, J).

    Returns:
        predictions (W, K+1, 2J) and columns (W, K+1, 2J, 2J + B): per unit of start state
        [rad, rad/s], then per torque.
    """
    states = start.shape[-1]
    moves = np.zeros((1 + states + len(torques), 1, states))
    moves[1 : 1 + states, 0] = STATE_STEP * np.eye(states)
    starts = start + moves
    torque = np.zeros((len(moves), *torques.shape[1:]))
    torque[1 + states :] = torques
    y = predict(model, windows, starts, torque)
    with np.errstate(invalid='ignore'):  # a wild window may reach infinity; `tame` finds it
        columns = y[1:] - y[0]
    columns[:states] /= STATE_STEP
    return y[0], np.moveaxis(columns, 0, -1)


def tame(columns: Array) -> Array:
    """Which windows have a finite sensitivity (W, K+1, 2J, B) of sensible size, (W,)."""
    sane: Array = np.abs(columns).max(axis=(1, 2, 3)) < WILD
    return sane


def nearer(windows: Windows, predicted: Array, columns: Array, sigma: Array) -> Array:
    """Start states (W, 2J) that fit the windows best, linearised about the measured ones.

    Contact makes the answer nonlinear: a foot that the noise of its start puts a millimetre
    into the ground leaps. Near the true start the columns mean what they say.

    Args:
        windows: the data.
        predicted: what `respond` found at the measured start.
        columns: the sensitivities it found there.
        sigma: noise of each window and channel, shape (W or 1, 1, 2J).
    """
    states = windows.measured.shape[-1]
    e = ((windows.measured - predicted) / sigma).reshape(windows.count, -1, 1)
    a = (columns / sigma[..., None]).reshape(windows.count, e.shape[1], -1)
    left, size, right = np.linalg.svd(a, full_matrices=False)
    known = size > LEAST_SEEN * size[:, :1]
    share = (np.swapaxes(left, -1, -2) @ e)[..., 0] / np.where(known, size, np.inf)
    step = (np.swapaxes(right, -1, -2) @ share[..., None])[..., 0]
    return windows.measured[:, 0] + step[:, :states]
