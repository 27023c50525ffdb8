# SPDX-License-Identifier: Apache-2.0
"""Measurement noise of a recording, from what no physics can explain in a short stretch."""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from scipy.special import gammaincinv

from leo_diffmodel.bags.recording import Recordings
from leo_diffmodel.compare import pushes
from leo_diffmodel.compare.settings import COMPARE
from leo_diffmodel.compare.windows import Array, cut, spread_out, Windows
from leo_sim.model import Model

HISTORY = COMPARE.history  # what windows keep before them [s]


def short_windows(recordings: Recordings) -> list[Windows]:
    """The short windows of each recording that its noise is read from; ValueError without any."""
    wanted = [round(COMPARE.noise_seconds / r.state_period) for r in recordings]
    counts = np.clip(wanted, *COMPARE.noise_intervals)
    both = zip(recordings, counts, strict=True)
    return [cut([r], n * r.state_period, history=HISTORY) for r, n in both]


def estimate(model: Model, short: Sequence[Windows]) -> Array:
    """Noise of each recording and channel, angles [rad] then rates [rad/s], shape (R, 2J).

    Each short window is fitted with a free start state and free missing torques (constant,
    growing in time and along the input), so that a wrong model does not count as noise. The
    median over windows keeps stretches with a mistimed switch from counting either. The angles
    are judged on their own: an encoder reads them, while a rate may be late or smoothed, and
    what it is off by then counts as its noise.
    """
    most = max(COMPARE.ground_noise_fewest, COMPARE.ground_noise_windows // len(short))
    return np.stack([_estimate(model, windows, most) for windows in short])


def of_inputs(model: Model, windows: Windows) -> Array | None:
    """What the noise of measured inputs adds to each sample of a window, (R, K+1, 2J), or None.

    A force that nobody exerted: predicted rates walk away from the robot's, and angles with them.
    The median over windows and draws, as some windows are chaotic.
    """
    robot, start = model.robot, windows.measured[:, 0]
    if not (robot.input_noise.any() and windows.count):
        return None
    samples = np.maximum(windows.dt * robot.state_rate, 1.0)  # in the mean of an interval
    size, rng = robot.input_noise / np.sqrt(samples)[..., None], np.random.default_rng(0)
    draws = size * rng.standard_normal((COMPARE.draws, *size.shape))
    noisy = replace(windows, inputs=windows.inputs + np.concatenate([0.0 * draws[:1], draws]))
    states = pushes.predict(model, noisy, start, near=True)
    square = (states[1:] - states[0]) ** 2
    count = max(len(windows.recordings), int(windows.source.max()) + 1)
    of_each = [windows.source == r for r in range(count)]
    typical = [np.median(square[:, some if some.any() else ...], axis=(0, 1)) for some in of_each]
    return np.sqrt(np.stack(typical) / _chi2(0.5, np.ones(1)))


def _estimate(model: Model, windows: Windows, most: int) -> Array:
    """The noise of one recording, on the ground from `most` windows, shape (2J,)."""
    quantile = 0.5
    if model.robot.contacts:
        quantile, windows = COMPARE.ground_quiet, spread_out(windows, most)
    finest = _finest(windows)
    windows = spread_out(windows, COMPARE.noise_windows // windows.q.shape[-1])
    torques = pushes.small_torques(model, windows, *pushes.flat_and_ramp(windows), _along(windows))
    predicted, columns = pushes.respond(model, windows, windows.measured[:, 0], torques)
    sigma = _read(windows.measured - predicted, columns, quantile)
    if model.robot.contacts:
        start = pushes.nearer(windows, predicted, columns, sigma[None, None])
        predicted, columns = pushes.respond(model, windows, start, torques)
        sane = pushes.tame(columns)
        if sane.any():
            again = _read((windows.measured - predicted)[sane], columns[sane], quantile)
            sigma = np.minimum(again, sigma)
        smooth = _about_curves(windows, quantile)
        sigma = np.where(smooth < COMPARE.curve_surely * sigma, smooth, sigma)
    return np.maximum(sigma, finest)


def _about_curves(windows: Windows, quantile: float) -> Array:
    """Noise of each channel about a curve through each window, without a model, shape (2J,).

    A wrong height of the ground, or of the sensor above it, is in every window with contact, and
    no start state takes it up.
    """
    degree = COMPARE.curve_degree
    even = np.linspace(-1, 1, windows.steps + 1)
    basis = np.linalg.qr(np.polynomial.legendre.legvander(even, degree))[0]
    rest = windows.measured - basis @ (basis.T @ windows.measured)
    degrees = windows.steps - degree
    square = np.quantile((rest**2).sum(axis=1), quantile, axis=0)
    return np.sqrt(square / _chi2(quantile, np.array(degrees)))


def _read(residual: Array, columns: Array, quantile: float) -> Array:
    """Noise of each channel in the residuals less what the columns explain, shape (2J,)."""
    joints = residual.shape[-1] // 2
    angle, sigma = np.arange(2 * joints) < joints, residual.std(axis=(0, 1)) + 1e-9
    of_angles = residual[..., angle], columns[..., angle, :], sigma[angle]
    sigma[angle] = _rounds(*of_angles, quantile, angle[angle])
    return _rounds(residual, columns, sigma, quantile, ~angle)


def _rounds(residual: Array, columns: Array, sigma: Array, quantile: float, free: Array) -> Array:
    """The noise once the `free` (2J,) channels have settled."""
    for _ in range(COMPARE.noise_rounds):
        before = sigma
        sigma = np.where(free, _reweighted(residual, columns, before, quantile), before)
        if (np.abs(sigma - before) < COMPARE.noise_settled * before).all():
            break
    return sigma


def _finest(windows: Windows) -> Array:
    """The least noise each channel can have, shape (2J,): rounding, and no channel is perfect."""
    measured = windows.measured
    rounding = [_resolution(measured[..., i]) / np.sqrt(12) for i in range(measured.shape[-1])]
    swing = measured.std(axis=(0, 1))
    joints = windows.q.shape[-1]
    swing[:joints] = np.minimum(swing[:joints], np.pi)  # turns are counted, not measured
    return np.maximum(np.maximum(rounding, COMPARE.finest * swing), COMPARE.stillest)


def _resolution(values: Array) -> float:
    """The step in which values are rounded; 0 where hardly any value repeats."""
    distinct = np.unique(values)
    if len(distinct) > COMPARE.rounded * values.size or len(distinct) < 3:
        return 0.0
    steps = np.diff(distinct)
    return float(steps[steps > COMPARE.finest * np.ptp(distinct)].min())


def _along(windows: Windows) -> Array:
    along = windows.inputs.sum(axis=-1)
    return np.asarray(along / max(float(np.abs(along).max()), 1e-12))


def _reweighted(residual: Array, columns: Array, sigma: Array, quantile: float) -> Array:
    """One round: project with the present weights, then rescale each channel.

    The share `quantile` of the windows has less left than the noise it is rescaled to.
    """
    channels = residual.shape[-1]
    e, a = pushes.whitened(residual, columns, sigma)
    left, size, _ = np.linalg.svd(a, full_matrices=False)
    basis = left * (size > 1e-7 * size[..., :1])[..., None, :]  # columns that vanish left out
    rest = e - (basis @ (np.swapaxes(basis, -1, -2) @ e[..., None]))[..., 0]
    free = 1.0 - (basis**2).sum(axis=-1)
    square = (rest**2).reshape(len(rest), -1, channels).sum(axis=1)
    degrees = free.reshape(len(rest), -1, channels).sum(axis=1)
    typical = np.median(degrees, axis=0)
    ratio = np.quantile(square / np.maximum(degrees, 1e-3), quantile, axis=0)
    scale = np.sqrt(ratio * typical / _chi2(quantile, typical))
    return np.maximum(sigma * scale, COMPARE.stillest)


def _chi2(share: float, degrees: Array) -> Array:
    """Quantile of chi-squared; scipy.stats takes a second to load."""
    return np.asarray(2.0 * gammaincinv(0.5 * degrees, share))
