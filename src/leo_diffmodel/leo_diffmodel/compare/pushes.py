# SPDX-License-Identifier: Apache-2.0
"""Predictions of windows, how finely they are integrated, and their sensitivities.

Sensitivities are to initial states and to torques that the model lacks.
"""

import numpy as np

from leo_diffmodel.compare.settings import COMPARE
from leo_diffmodel.compare.sizes import torque_scale
from leo_diffmodel.compare.windows import Array, per_window, spread_out, Windows
from leo_sim.dynamics.whole_windows import Along
from leo_sim.model import Model
from leo_sim.model.batch import rollout

SCHEMES = ('search', 'training')  # the coarsest first


def predict(
    model: Model,
    windows: Windows,
    start: Array,
    push: Array | None = None,
    near: bool | Along = False,
) -> Array:
    """Sensed states (..., W, K+1, 2J) from start states (..., W, 2J), `near` as in `rollout`."""
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
        near=near,
    )
    return np.concatenate([q, dq], axis=-1)


def own(model: Model, windows: Windows, instants: bool = False) -> Model:
    """The model with the constants of each window's own recording.

    For states (..., W, J), or (W, K, J) of several instants in each window.
    """
    source = windows.source[:, None] if instants else windows.source
    return model.of_recordings(windows.recordings, source)


def respond(model: Model, windows: Windows, start: Array, torques: Array) -> tuple[Array, Array]:
    """Predicted states and their sensitivities, of one rollout of states near the first.

    From start states (W, 2J) and small extra joint torques (B, W, K, J) [N m]: predictions
    (W, K+1, 2J), and columns (W, K+1, 2J, 2J + B) per unit of start state [rad, rad/s], then per
    torque.
    """
    states = start.shape[-1]
    moves = np.zeros((1 + states + len(torques), 1, states))
    moves[1 : 1 + states, 0] = COMPARE.state_step * np.eye(states)
    starts = start + moves
    torque = np.zeros((len(moves), *torques.shape[1:]))
    torque[1 + states :] = torques
    y = predict(model, windows, starts, torque, near=True)
    with np.errstate(invalid='ignore'):  # a window may reach infinity; `tame` finds it
        columns = y[1:] - y[0]
    columns[:states] /= COMPARE.state_step
    return y[0], np.moveaxis(columns, 0, -1)


def whitened(error: Array, columns: Array, sigma: Array) -> tuple[Array, Array]:
    """Errors (W, K+1, 2J) and columns (W, K+1, 2J, B) in noise sigmas: (W, N) and (W, N, B)."""
    e = (error / sigma).reshape(len(error), -1)
    return e, (columns / sigma[..., None]).reshape(*e.shape, -1)


def small_torques(model: Model, windows: Windows, *shapes: Array) -> Array:
    """At each joint a small torque along each of S shapes (W, K): (J S, W, K, J) [N m]."""
    size = COMPARE.small_torque * torque_scale(model.robot)
    return size * np.stack([s[..., None] * e for e in np.eye(windows.q.shape[-1]) for s in shapes])


def flat_and_ramp(windows: Windows) -> tuple[Array, Array]:
    """A torque that stays, and one that grows from -1 to 1, each (W, K)."""
    flat = np.ones_like(windows.dt)
    return flat, np.broadcast_to(np.linspace(-1, 1, windows.steps), flat.shape)


def tame(columns: Array) -> Array:
    """Which windows have a finite sensitivity (W, K+1, 2J, B) of sensible size, (W,)."""
    sane: Array = np.abs(columns).max(axis=(1, 2, 3)) < COMPARE.most_sensitive
    return sane


def nearer(windows: Windows, predicted: Array, columns: Array, sigma: Array) -> Array:
    """Start states (W, 2J) that fit best, linearised about the measured ones by `respond`.

    `sigma` is the noise of each window and channel, (W or 1, 1, 2J).

    Contact makes the answer nonlinear: a foot that the noise of its start puts a millimetre into
    the ground leaps. Near the true start the columns mean what they say.
    """
    states = windows.measured.shape[-1]
    e, a = whitened(windows.measured - predicted, columns, sigma)
    left, size, right = np.linalg.svd(a, full_matrices=False)
    known = size > COMPARE.least_seen * size[:, :1]
    share = (np.swapaxes(left, -1, -2) @ e[..., None])[..., 0] / np.where(known, size, np.inf)
    step = (np.swapaxes(right, -1, -2) @ share[..., None])[..., 0]
    return windows.measured[:, 0] + step[:, :states]


def fast_enough(model: Model, windows: Windows) -> Model:
    """The model with the coarsest of its schemes that is as good on short windows of the data.

    Its typical difference is a small part of what the model is off by anyway, and larger ones are
    rare: a landing foot is some rad/s apart now and then in any two schemes.
    """
    if not model.robot.contacts or model.scheme != 'reference':
        return model
    some = spread_out(windows, COMPARE.scheme_windows)
    start = some.measured[:, 0]
    fine = predict(model, some, start)[:, -1]
    off = np.sqrt(np.median((some.measured[:, -1] - fine) ** 2, axis=0)) + 1e-12
    for scheme in SCHEMES:
        coarse = model.changed(scheme=scheme)
        apart = np.abs(predict(coarse, some, start)[:, -1] - fine) / off
        often, rarely = np.median(apart), (apart > 1.0).mean()
        if often < COMPARE.scheme_typical and rarely < COMPARE.scheme_rare:
            return coarse
    return model


def stepped(model: Model, windows: Windows, sigma: Array) -> Model:
    """The model with the longest integration step that hardly changes its predictions.

    Rms over windows, a prediction may change by a twentieth of its error, or of the noise of the
    reading (R, 2J). Where it is off by more than the state moves, it predicts nothing, and may
    change. On the ground see `fast_enough`.
    """
    if model.robot.contacts or model.integration_step >= COMPARE.integration_step:
        return model
    some = spread_out(windows, COMPARE.step_windows)
    exact = predict(model, some, some.measured[:, 0])
    error, swing = _rms(some.measured - exact), some.measured.std(axis=(0, 1))
    most = COMPARE.step_share * np.maximum(error, _rms(per_window(sigma, some)))
    most = np.where(error < swing, most, np.inf)
    step = COMPARE.integration_step
    while step > model.integration_step:
        coarse = model.changed(integration_step=step)
        if (_rms(predict(coarse, some, some.measured[:, 0]) - exact) <= most).all():
            return coarse
        step *= 0.5
    return model


def _rms(states: Array) -> Array:
    return np.asarray(np.sqrt((states**2).mean(axis=0)))
