# SPDX-License-Identifier: Apache-2.0
"""The torque the model lacks at each joint and instant."""

from collections.abc import Callable, Generator, Mapping
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from leo_diffmodel.bags.episode import sample_period
from leo_diffmodel.bags.recording import Recordings
from leo_diffmodel.bags.types import at_rows
from leo_diffmodel.compare.conditions import carrying
from leo_diffmodel.compare.errors import has_memory
from leo_diffmodel.compare.pushes import nearer, predict, respond, small_torques, whitened
from leo_diffmodel.compare.settings import COMPARE
from leo_diffmodel.compare.sizes import push_scale, torque_scale
from leo_diffmodel.compare.windows import Array, cut, per_window, spread_out, Windows
from leo_sim.model import Model

MOST_DRAWN = 1500  # windows whose torque a page shows


@dataclass(frozen=True)
class MissingTorque:
    """Missing torque by least squares over short windows, each with a free start state."""

    time: Array  # middle of each window [s], shape (W,)
    torque: Array  # constant torque that the model lacks there [N m], shape (W, J)
    spread: Array  # its standard deviation from measurement noise [N m], shape (W, J)
    q: Array  # mean joint angle [rad], shape (W, J)
    dq: Array  # mean joint rate [rad/s], shape (W, J)
    inputs: Array  # mean input [V, N m or rad], shape (W, A)
    windows: Windows
    carrying: Array | None = None
    """Which spheres the ground presses on at each sample, shape (W, K+1, P); None for a robot
    without a ground."""
    bend: Array | None = None
    """How far from linear the answer to the torque is (mean square, in noise variances), as where
    a contact begins or ends, shape (W,); None for a robot without a ground."""
    untrusted: float = 0.0  # share of the windows that were left out because of that

    @property
    def seen(self) -> Array:
        """Where a torque could show, shape (W, J): not where stance or a held base hides it."""
        return np.isfinite(self.spread)

    def take(self, index: Array) -> 'MissingTorque':
        return replace(at_rows(self, index), windows=self.windows.take(index))


def missing_torque(recordings: Recordings, model: Model, sigma: Array) -> MissingTorque:
    """The missing torque over short windows.

    Windows in which no torque would show are left out (a joint that dry friction holds still),
    unless there are no others.
    """
    windows = torque_windows(recordings, model, COMPARE.history if has_memory(model) else 0.0)
    return trusted(estimate(model, windows, sigma), model)


def torque_windows(recordings: Recordings, model: Model, history: float) -> Windows:
    """Short windows next to each other, `history` [s] before each; on the ground some of them.

    ValueError where no episode holds one.
    """
    windows = cut(recordings, window_seconds(recordings), history=history)
    return spread_out(windows, COMPARE.ground_torque_windows) if model.robot.contacts else windows


def trusted(found: MissingTorque, model: Model) -> MissingTorque:
    """The windows in which a torque would show; all of them where none would show in any.

    On the ground those whose answer is linear, and in them the joints at which it would show: a
    standing foot hides one torque and not another.
    """
    if found.bend is None:
        clear = np.all(found.spread < COMPARE.torque_shown * torque_scale(model.robot), axis=1)
        return found.take(np.flatnonzero(clear if clear.any() else ~clear))
    sure = found.bend < COMPARE.most_bend
    shown = found.spread < COMPARE.torque_shown * push_scale(model.robot)
    kept = np.flatnonzero((sure if sure.any() else ~sure) & shown.any(axis=1))
    if not kept.size:
        return found
    found = replace(found, spread=np.where(shown, found.spread, np.inf))
    return replace(found.take(kept), untrusted=float(1.0 - sure.mean()))


def window_seconds(recordings: Recordings) -> float:
    """How long the windows are in which a torque is estimated [s]: five samples at least."""
    return max(COMPARE.torque_intervals * sample_period(recordings), COMPARE.torque_seconds)


def estimate(model: Model, windows: Windows, sigma: Array) -> MissingTorque:
    """Least squares for a constant torque per window and joint, with a free start state.

    The model lacks it; positive turns the joint forward. `sigma` is the noise, (R, 2J).
    """
    joints = windows.q.shape[-1]
    unit = COMPARE.small_torque * torque_scale(model.robot)
    torques = small_torques(model, windows, np.ones_like(windows.dt))
    start = windows.measured[:, 0]
    predicted, columns = respond(model, windows, start, torques)
    noise = per_window(sigma, windows)
    if model.robot.contacts:
        start = nearer(windows, predicted, columns, noise)
        predicted, columns = respond(model, windows, start, torques)
    e, a = whitened(windows.measured - predicted, columns, noise)
    inverse = _covariance(a)
    found = (inverse @ (np.swapaxes(a, -1, -2) @ e[..., None]))[..., 0]
    variance = np.diagonal(inverse, axis1=-2, axis2=-1)[:, -joints:]
    states = None
    if model.robot.contacts:
        pushed = np.broadcast_to(unit * found[:, None, -joints:], (*windows.dt.shape, joints))
        states = predict(model, windows, start + found[:, :-joints], push=pushed)
    linear = predicted + np.einsum('wkij,wj->wki', columns, found)
    fixed = windows.held[:, None] & (np.arange(joints) < len(model.robot.base_joints))
    return MissingTorque(
        time=windows.start + 0.5 * windows.dt.sum(axis=1),
        torque=unit * found[:, -joints:],
        spread=np.where(fixed, np.inf, unit * np.sqrt(variance)),
        q=windows.q.mean(axis=1),
        dq=windows.dq.mean(axis=1),
        inputs=windows.inputs.mean(axis=1),
        windows=windows,
        carrying=None if states is None else carrying(model, states),
        bend=None if states is None else (((states - linear) / noise) ** 2).mean(axis=(1, 2)),
    )


def supposed(model: Model, other: Model, windows: Windows, sigma: Array) -> MissingTorque:
    """What `estimate` would find missing from a model if another were the robot.

    The measured states give way to those that the other model predicts from the measured start.
    """
    states = predict(other, windows, windows.measured[:, 0])
    joints = windows.q.shape[-1]
    replayed = replace(windows, q=states[..., :joints], dq=states[..., joints:])
    return estimate(model, replayed, sigma)


def lacking_and_supposed(
    recordings: Recordings, model: Model, others: Mapping[str, Model], sigma: Array
) -> tuple[MissingTorque, dict[str, Array]]:
    """What a model lacks, in windows as many as a page can draw, each with a past.

    Also what it would be by each other model [N m], (W, J).
    """
    windows = cut(recordings, window_seconds(recordings), history=COMPARE.history)
    found = trusted(estimate(model, spread_out(windows, MOST_DRAWN), sigma), model)
    parts = {name: supposed(model, m, found.windows, sigma) for name, m in others.items()}
    return found, {name: part.torque for name, part in parts.items()}


def in_parts(
    work: Callable[[Windows], MissingTorque], windows: Windows, most: int
) -> Generator[bool, None, MissingTorque]:
    """What `work` makes of the windows, `most` at a time; yields after each part."""
    parts = []
    for first in range(0, windows.count, most):
        parts.append(work(windows.take(np.arange(first, min(first + most, windows.count)))))
        yield False
    arrays = [name for name, value in vars(parts[0]).items() if isinstance(value, np.ndarray)]
    whole: dict[str, Any] = {n: np.concatenate([getattr(p, n) for p in parts]) for n in arrays}
    return replace(parts[0], windows=windows, **whole)


def _covariance(a: Array) -> Array:
    """Covariance of start states and torques, shape (W, P, P), from whitened columns (W, N, P).

    Scaled to unit diagonal before it is inverted: with a contact the columns differ by more than
    floating-point numbers resolve.
    """
    normal = np.swapaxes(a, -1, -2) @ a + COMPARE.weak * np.eye(a.shape[-1])
    size = np.sqrt(np.diagonal(normal, axis1=-2, axis2=-1))
    scale = size[..., None] * size[..., None, :]
    return np.linalg.inv(normal / scale + COMPARE.rounding * np.eye(a.shape[-1])) / scale
