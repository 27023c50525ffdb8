# SPDX-License-Identifier: Apache-2.0
"""Measurement noise of a recording, from what no physics can explain in a short stretch."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from scipy.special import gammaincinv

from leo_diffmodel.bags.recording import Recording
from leo_diffmodel.compare.pushes import nearer, respond, tame
from leo_diffmodel.compare.sizes import torque_scale
from leo_diffmodel.compare.windows import cut, sample_period, Windows
from leo_sim.model import Model

Array = np.ndarray
INTERVALS = 8
HISTORY = 0.15
FINEST = 1e-5
"""No sensor resolves less than this share of its own swing: noise-free data stay regular."""
STILLEST = 1e-8
"""rad, rad/s: the noise of a channel that never changes, as a base that is held."""
MOST_WINDOWS = 3000
"""Divided by the joints: their noise is then known to 2 %, and more would only take longer."""
ROUNDS = 8
SETTLED = 1e-5
"""Change of the noise in a round, as a share of it, after which no further one follows."""
ON_GROUND_WINDOWS, FEWEST_OF_BAG = 60, 30
ON_GROUND_SHARE = 0.25
"""Of the short windows of a robot on the ground, the quiet ones tell the noise."""
SMOOTH, SURELY = 3, 0.8
"""Degree of the curve that a quiet stretch follows; noise about it counts if so much less."""
ROUNDED = 0.5
"""Values are taken for rounded where fewer than this share of them are distinct."""


def short_windows(recordings: Sequence[Recording]) -> list[Windows]:
    """The short windows of each recording that its noise is read from: eight intervals each.

    Raises:
        ValueError: a recording is too short for a single one.
    """
    return [cut([r], INTERVALS * sample_period([r]), history=HISTORY) for r in recordings]


def estimate(model: Model, short: Sequence[Windows]) -> Array:
    """Noise of each recording and channel, angles [rad] then rates [rad/s], shape (R, 2J).

    Each short window is fitted with a free start state and free missing torques (constant,
    growing in time and along the input), so that a wrong model does not count as noise. The
    median over windows keeps stretches with a mistimed switch from counting either. The angles
    are judged on their own: an encoder reads them, while a rate may be late or smoothed, and
    what it is off by then counts as its noise.
    """
    most = max(FEWEST_OF_BAG, ON_GROUND_WINDOWS // len(short))
    return np.stack([_estimate(model, windows, most) for windows in short])


def per_window(sigma: Array, windows: Windows) -> Array:
    """The noise of the recording each window comes from, shape (W, 1, 2J)."""
    return sigma[windows.source][:, None, :]


def _estimate(model: Model, windows: Windows, most: int) -> Array:
    """The noise of one recording; of a robot on the ground from so many windows at `most`."""
    quantile = 0.5
    if model.robot.contacts:
        quantile, windows = ON_GROUND_SHARE, spread_out(windows, most)
    finest = _finest(windows)
    windows = spread_out(windows, MOST_WINDOWS // windows.q.shape[-1])
    torques = _torques(model, windows)
    predicted, columns = respond(model, windows, windows.measured[:, 0], torques)
    sigma = _read(windows.measured - predicted, columns, quantile)
    if model.robot.contacts:
        start = nearer(windows, predicted, columns, sigma[None, None])
        predicted, columns = respond(model, windows, start, torques)
        sane = tame(columns)
        if sane.any():
            again = _read((windows.measured - predicted)[sane], columns[sane], quantile)
            sigma = np.minimum(again, sigma)
        smooth = _about_curves(windows, quantile)
        sigma = np.where(smooth < SURELY * sigma, smooth, sigma)
    return np.maximum(sigma, finest)


def _about_curves(windows: Windows, quantile: float) -> Array:
    """Noise of each channel about a curve through each window, without a model, shape (2J,).

    A wrong height of the ground, or of the sensor above it, is in every window with contact, and
    no start state takes it up.
    """
    curves = np.polynomial.legendre.legvander(np.linspace(-1, 1, windows.steps + 1), SMOOTH)
    basis = np.linalg.qr(curves)[0]
    rest = windows.measured - basis @ (basis.T @ windows.measured)
    degrees = windows.steps - SMOOTH
    square = np.quantile((rest**2).sum(axis=1), quantile, axis=0)
    return np.sqrt(square / _chi2(quantile, np.array(degrees)))


def spread_out(windows: Windows, most: int) -> Windows:
    """At most so many of the windows, evenly chosen."""
    if windows.count <= most:
        return windows
    return windows.take(np.linspace(0, windows.count - 1, most).astype(int))


def _read(residual: Array, columns: Array, quantile: float) -> Array:
    """Noise of each channel in the residuals less what the columns explain, shape (2J,)."""
    joints = residual.shape[-1] // 2
    angle, sigma = np.arange(2 * joints) < joints, residual.std(axis=(0, 1)) + 1e-9
    sigma[angle] = _rounds(
        residual[..., angle], columns[..., angle, :], sigma[angle], quantile, angle[angle]
    )
    return _rounds(residual, columns, sigma, quantile, ~angle)


def _rounds(residual: Array, columns: Array, sigma: Array, quantile: float, free: Array) -> Array:
    """The noise once the `free` (2J,) channels have settled."""
    for _ in range(ROUNDS):
        before = sigma
        sigma = np.where(free, _reweighted(residual, columns, before, quantile), before)
        if (np.abs(sigma - before) < SETTLED * before).all():
            break
    return sigma


def _finest(windows: Windows) -> Array:
    """The least noise each channel can have, shape (2J,): rounding, and no channel is perfect."""
    measured = windows.measured
    rounding = [_resolution(measured[..., i]) / np.sqrt(12) for i in range(measured.shape[-1])]
    swing = measured.std(axis=(0, 1))
    joints = windows.q.shape[-1]
    swing[:joints] = np.minimum(swing[:joints], np.pi)  # turns are counted, not measured
    return np.maximum(np.maximum(rounding, FINEST * swing), STILLEST)


def _resolution(values: Array) -> float:
    """The step in which values are rounded; 0 where hardly any value repeats."""
    distinct = np.unique(values)
    if len(distinct) > ROUNDED * values.size or len(distinct) < 3:
        return 0.0
    steps = np.diff(distinct)
    return float(steps[steps > FINEST * np.ptp(distinct)].min())


def _torques(model: Model, windows: Windows) -> Array:
    """Small torques at each joint: constant, a ramp, and along the input; shape (3J, W, K, J)."""
    joints = windows.q.shape[-1]
    size = 1e-3 * torque_scale(model.robot)
    flat = np.ones_like(windows.dt)
    ramp = np.broadcast_to(np.linspace(-1, 1, windows.steps), flat.shape)
    along = windows.inputs.sum(axis=-1)
    along = along / max(float(np.abs(along).max()), 1e-12)
    shapes = [s[..., None] * np.eye(joints)[j] for j in range(joints) for s in (flat, ramp, along)]
    return size * np.stack(shapes)


def _reweighted(residual: Array, columns: Array, sigma: Array, quantile: float) -> Array:
    """One round: project with the present weights, then rescale each channel.

    The share `quantile` of the windows has less left than the noise it is rescaled to.
    """
    channels = residual.shape[-1]
    e = (residual / sigma).reshape(len(residual), -1)
    a = (columns / sigma[:, None]).reshape(len(residual), -1, columns.shape[-1])
    basis = _orthonormal(a)
    rest = e - (basis @ (np.swapaxes(basis, -1, -2) @ e[..., None]))[..., 0]
    free = 1.0 - (basis**2).sum(axis=-1)
    square = (rest**2).reshape(len(rest), -1, channels).sum(axis=1)
    degrees = free.reshape(len(rest), -1, channels).sum(axis=1)
    typical = np.median(degrees, axis=0)
    ratio = np.quantile(square / np.maximum(degrees, 1e-3), quantile, axis=0)
    return np.maximum(sigma * np.sqrt(ratio * typical / _chi2(quantile, typical)), STILLEST)


def _orthonormal(columns: Array) -> Array:
    """Orthonormal basis of each window's columns; columns that vanish are left out."""
    left, size, _ = np.linalg.svd(columns, full_matrices=False)
    return left * (size > 1e-7 * size[..., :1])[..., None, :]


def _chi2(share: float, degrees: Array) -> Array:
    """Quantile of chi-squared; scipy.stats takes a second to load."""
    found: Array = 2.0 * gammaincinv(0.5 * degrees, share)
    return found
