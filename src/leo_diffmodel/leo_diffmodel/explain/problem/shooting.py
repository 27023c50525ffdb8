# SPDX-License-Identifier: Apache-2.0
"""Multiple shooting: every window has its own free start state, all share the parameters.

The measured start of a window is noisy, so it is not trusted: the start state is a nuisance
of the window, eliminated by an orthogonal projection (a Schur complement), which leaves a
log-likelihood of the parameters alone. For small noise this equals whitening with the start
noise propagated through the window, and it stays right for long ones
(docs/reference/identification.md 1.1).
"""

from __future__ import annotations

from dataclasses import dataclass
import math

import numpy as np
from scipy.special import chdtri

from leo_diffmodel.compare.pushes import predict as predict
from leo_diffmodel.compare.windows import per_window, Windows
from leo_diffmodel.explain.problem.hypothesis import Hypothesis
from leo_diffmodel.explain.settings import Numerics
from leo_sim.common.compiled import compiled
from leo_sim.model import Model

Array = np.ndarray


@dataclass(frozen=True)
class Linear:
    """A hypothesis linearised at one point, in units of the measurement noise.

    Attributes:
        residual: (measured - predicted) / sigma, shape (W, N), N = (K+1) 2J.
        by_start: its sensitivity to the window's start state, shape (W, N, 2J).
        by_theta: its sensitivity to the parameters, shape (W, N, P).
    """

    residual: Array
    by_start: Array
    by_theta: Array


def whiten(windows: Windows, predicted: Array, sigma: Array, farthest: float) -> Array:
    """(measured - predicted) / sigma with time and channel in one axis, shape (..., W, N).

    Cut at `farthest`: a hypothesis may send a robot to infinity.
    """
    scaled = (windows.measured - predicted) / per_window(sigma, windows)
    scaled = np.nan_to_num(np.clip(scaled, -farthest, farthest), nan=farthest)
    return scaled.reshape(*scaled.shape[:-2], -1)


def linearise(
    base: Model,
    windows: Windows,
    sigma: Array,
    numerics: Numerics,
    hypothesis: Hypothesis,
    theta: Array,
    start: Array,
    by_start: Array | None = None,
    errors: Array | None = None,
    rough: Model | None = None,
) -> Linear:
    """The residual of a hypothesis, and all finite differences in one batched rollout.

    Args:
        base: the model the hypothesis changes.
        windows: the data.
        sigma: noise of each recording and channel, shape (R, 2J).
        numerics: how far parameters are moved.
        hypothesis: what is free.
        theta: parameters, shape (P,).
        start: start states, shape (W, 2J).
        by_start: sensitivity of the whitened residual to them where it is known, shape
            (W, N, 2J); None finds it.
        errors: standard error of each parameter with the others fixed, shape (P,), where it is
            known: how far it is moved for its difference.
        rough: `base` as it is integrated for the differences; by default as it is.
    """
    moved = hypothesis.together
    states, size = start.shape[-1] if by_start is None else 0, len(moved)
    nudge = 0.5 * sigma.min(axis=0)
    step = difference_steps(hypothesis, theta, errors, numerics)
    starts = np.broadcast_to(start, (1 + states + size, *start.shape)).copy()
    thetas = np.broadcast_to(theta, (1 + states + size, len(theta))).copy()
    for i in range(states):
        starts[1 + i, :, i] += nudge[i]
    for row, some in enumerate(moved, 1 + states):
        thetas[row, some] += step[some]
    rough = rough or base
    e = _residuals(rough, windows, sigma, numerics, hypothesis, thetas, starts)
    residual = e[0]
    if rough is not base:
        residual = _residuals(base, windows, sigma, numerics, hypothesis, theta, start)
    if by_start is None:
        by_start = np.stack([(e[1 + i] - e[0]) / nudge[i] for i in range(states)], axis=-1)
    by_theta = np.zeros((*e[0].shape, len(theta)))
    for row, some in enumerate(moved, 1 + states):
        for i in some:
            seen = _seen(windows, hypothesis.recordings[i])
            by_theta[seen, :, i] = (e[row, seen] - e[0, seen]) / step[i]
    return Linear(residual, by_start, by_theta)


def _residuals(
    base: Model,
    windows: Windows,
    sigma: Array,
    numerics: Numerics,
    hypothesis: Hypothesis,
    theta: Array,
    start: Array,
) -> Array:
    """Whitened residuals of a hypothesis at some values (..., P) and start states (..., W, 2J)."""
    model = hypothesis.model(base, theta) if theta.shape[-1] else base
    return whiten(windows, predict(model, windows, start), sigma, numerics.farthest)


def _seen(windows: Windows, recording: str) -> Array | slice:
    """Windows that see the parameter of a recording, or one that all share ('')."""
    return windows.of(recording) if recording else slice(None)


def difference_steps(
    hypothesis: Hypothesis, theta: Array, errors: Array | None, numerics: Numerics
) -> Array:
    """Finite steps: as far as the data can tell a parameter, turned off the bounds.

    A law with a corner (dry friction, a dead zone) is straight only between two samples that
    change sides; a step that holds many of these sees the slope that the loss has over the width
    of its minimum. Without standard errors a small share of what it is away from neutral.
    """
    away = np.abs(theta - hypothesis.neutral)
    step = numerics.difference * np.maximum(away, 1e-2 * np.maximum(np.abs(theta), 1e-6))
    if errors is not None:
        width, longest = hypothesis.high - hypothesis.low, numerics.longest_difference
        most = np.maximum(
            np.maximum(np.abs(theta), away), np.where(np.isfinite(width), longest * width, 0.0)
        )
        step = np.clip(errors, step, np.maximum(step, longest * most))
    return np.where(theta + step > hypothesis.high, -step, step)


def eliminate(linear: Linear, weight: Array | None = None) -> tuple[Array, Array, Array, Array]:
    """Project the start states out.

    Returns:
        residual and by_theta without what the start states explain, then the two maps that give
        the start state's own step: solve (W, 2J) for the residual and gain (W, 2J, P).
    """
    root = 1.0 if weight is None else np.sqrt(weight)[..., None]
    basis, triangle = np.linalg.qr(linear.by_start * root)
    hidden = np.diagonal(triangle, axis1=-2, axis2=-1) == 0  # a start that does not show stays
    basis = np.where(hidden[..., None, :], 0.0, basis)
    triangle = np.where(hidden[..., None], np.eye(triangle.shape[-1]), triangle)
    residual, by_theta = linear.residual[..., None] * root, linear.by_theta * root
    seen, gain = _times(basis, residual), _times(basis, by_theta)
    rest = (residual - basis @ seen)[..., 0]
    return (
        rest,
        by_theta - basis @ gain,
        np.linalg.solve(triangle, seen)[..., 0],
        np.linalg.solve(triangle, gain),
    )


def _times(basis: Array, columns: Array) -> Array:
    return np.swapaxes(basis, -1, -2) @ columns


def dispersion(residual: Array, states: int) -> float:
    """How many times less nats count where residuals (W, N) are correlated in time.

    1 for white noise. On real data something unmodelled is always left; neighbouring samples then
    tell the same story. Its size is no matter here: `loss` finds it in each window. `states` start
    states (2J) were free in each window.
    """
    joints = states // 2
    angles = residual.reshape(len(residual), -1, states)[..., :joints]
    power = np.maximum((angles**2).sum(axis=(1, 2)), 1e-12)
    along = (angles[:, 1:] * angles[:, :-1]).sum(axis=(1, 2)) / power
    follow = min(max(float(np.mean(along)), 0.0), 0.95)
    return (1 + follow) / (1 - follow)


def excess(residual: Array, states: int, quantile: float = 0.5) -> float:
    """Mean squared whitened residual (W, N) over its expected value.

    The sum over a window of N channels with 2J free start states is chi-squared with N - 2J
    degrees of freedom (Pintelon, Schoukens and Vandersteen 1997); a quantile over windows, not
    their mean, keeps a hand push from deciding.
    """
    expected = chdtri(residual.shape[-1] - states, 1.0 - quantile)
    return float(np.quantile((residual**2).sum(axis=-1), quantile) / expected)


def robust_weight(
    residual: Array, channels: int, numerics: Numerics, typical: Array | None = None
) -> Array:
    """Weight of each sample, (..., W, N): of the parabola that touches `loss` there."""
    samples, off = _by_channel(residual, channels), size(residual, channels, numerics, typical)
    weight = huber_weight(samples / off, numerics.huber) / off**2
    return np.broadcast_to(weight, samples.shape).reshape(residual.shape)


def loss(
    residual: Array, channels: int, numerics: Numerics, typical: Array | None = None
) -> Array:
    """Loss of each window [nats], (..., W), from residuals (..., W, N) in noise units.

    In each window each channel has its own size of what the model is off by: -log of the
    likelihood with the size that is most likely beyond what noise alone may be, where sizes are
    spread about a typical one as an inverse gamma variable is. So neither the windows where every
    hypothesis is wrong decide between them, nor those where nothing happens. Samples far out are
    weighed down as in Huber's loss (his second proposal, 1964, has location and size together).

    Args:
        residual: in noise units.
        channels: how many there are, 2J.
        numerics: where it bends, and how sizes are found.
        typical: size of each, (1, 2J), see `typical_size`; None lets each window speak for itself.
    """
    off, count = size(residual, channels, numerics, typical), residual.shape[-1] // channels
    scaled = (_by_channel(residual, channels) / off).reshape(residual.shape)
    total: Array = huber(scaled, numerics.huber)
    own = np.log(off) + 0.5 * _noise_beyond(count, numerics) * (1.0 - off**-2.0)
    if typical is not None:
        apart = np.log(off / typical) + 0.5 * ((typical / off) ** 2 - 1.0)
        own = own + numerics.shared * apart
    return total + count * own.sum(axis=(-2, -1))


def unexplained(residual: Array, channels: int, numerics: Numerics) -> Array:
    """What a model that leaves only noise would save in each window [nats], (..., W)."""
    count = residual.shape[-1] // channels
    total: Array = np.log(size(residual, channels, numerics)).sum(axis=(-2, -1))
    return count * total


def promised(
    change: Array, residual: Array, channels: int, numerics: Numerics, typical: Array | None = None
) -> Array:
    """What a change of the prediction costs where it was right but for noise [nats], (..., W).

    Args:
        change: of the whitened residual, shape (..., W, N).
        residual: before; its size in each channel stands for the noise, same shape.
        channels: how many there are, 2J.
        numerics: see `loss`.
        typical: see `loss`.
    """
    count, off = residual.shape[-1] // channels, size(residual, channels, numerics, typical)
    square = ((_by_channel(change, channels) / off) ** 2).mean(axis=-2)
    noisy = size(residual, channels, numerics)[..., 0, :] == 1.0
    beyond = np.where(noisy, _noise_beyond(count, numerics), 0.0)
    more, times = np.maximum(square - beyond, 0.0), times_told(numerics, typical)
    each = np.minimum(square, beyond) + times * np.log1p(more / times)
    total: Array = 0.5 * count * each.sum(axis=-1)
    return total


def times_told(numerics: Numerics, typical: Array | None) -> float:
    """How many times as much is told of a size in one window as that window tells itself."""
    return 1.0 if typical is None else 1.0 + numerics.shared


def swollen(residual: Array, channels: int, numerics: Numerics, share: float) -> Array:
    """What so much more (mean square) of what is beyond noise would cost [nats], (..., W)."""
    count = residual.shape[-1] // channels
    beyond: Array = (size(residual, channels, numerics) > 1.0).sum(axis=(-2, -1))
    return 0.5 * np.log1p(share) * count * beyond


def _by_channel(residual: Array, channels: int) -> Array:
    count = residual.shape[-1] // channels
    return residual.reshape(*residual.shape[:-1], count, channels)


def size(
    residual: Array, channels: int, numerics: Numerics, typical: Array | None = None
) -> Array:
    """Size of what each channel is off by in each window, 1 where that is noise, (..., W, 1, 2J).

    Its square is the mean square less what noise alone exceeds in one of 20 windows, and as far
    as it is shared that of the typical size.
    """
    samples = _by_channel(residual, channels)
    beyond, lead = _noise_beyond(samples.shape[-2], numerics), samples.shape[:-2]
    rows = np.array(samples, dtype=float).reshape(-1, *samples.shape[-2:])
    shared = 0.0 if typical is None else numerics.shared
    about = np.ones(channels) if typical is None else np.array(typical[0], dtype=float)
    found = _sizes(rows, beyond, about, shared, numerics.huber, numerics.size_rounds)
    return np.asarray(found).reshape(*lead, 1, channels)


@compiled
def _sizes(
    samples: Array, beyond: float, typical: Array, shared: float, huber: float, rounds: int
) -> Array:
    """Size of each channel in each row, (R, 2J), of samples (R, K + 1, 2J)."""
    rows, count, channels = samples.shape
    found = np.ones((rows, channels))
    for r in range(rows):
        for c in range(channels):
            for _ in range(rounds):
                most, total = huber * found[r, c], 0.0
                for k in range(count):
                    off = abs(samples[r, k, c])
                    total += off * min(off, most)
                square = max(total / count - beyond, 1.0)
                size = math.sqrt((square + shared * typical[c] ** 2) / (1.0 + shared))
                if size == found[r, c]:
                    break
                found[r, c] = size
    return found


def typical_size(residual: Array, channels: int, numerics: Numerics) -> Array:
    """The size that is most likely typical of all windows (W, N) in each channel, (1, 2J)."""
    if not len(residual):
        return np.ones((1, channels))
    own, shared = size(residual, channels, numerics) ** 2, numerics.shared
    found: Array = np.exp(np.log(own).mean(axis=0))
    for _ in range(numerics.size_rounds):
        found = 1.0 / ((1.0 + shared) / (own + shared * found)).mean(axis=0)
    return np.sqrt(found)


def _noise_beyond(count: int, numerics: Numerics) -> float:
    """How much the mean square of so many samples of noise may be above 1."""
    return float(chdtri(count, numerics.noise_reaches)) / count - 1.0


def huber_weight(residual: Array, knee: float) -> Array:
    """Huber weights: 1 within the knee [sigma], falling as 1/|r| outside."""
    return np.minimum(1.0, knee / np.maximum(np.abs(residual), 1e-12))


def huber(residual: Array, knee: float) -> Array:
    """Huber loss of each window [nats], linear beyond the knee, from residuals (..., W, N)."""
    size = np.abs(residual)
    loss = np.where(size <= knee, 0.5 * size**2, knee * (size - 0.5 * knee))
    return loss.sum(axis=-1)
