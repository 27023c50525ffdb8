# SPDX-License-Identifier: Apache-2.0
"""Loss of whitened residuals, robust and with a free size of error in each window and channel.

Here `residual` is in units of the noise, (..., W, N) with N = (K+1) 2J, and `channels` is 2J.
`typical` is the size of what the model is off by in most windows, (1, 2J), see `typical_size`;
None lets each window speak for itself.
"""

import math

import numpy as np
from scipy.special import chdtri, huber

from leo_diffmodel.compare.windows import Array
from leo_diffmodel.explain.settings import Numerics
from leo_sim.common.compiled import compiled


def dispersion(residual: Array, states: int) -> float:
    """How many times less nats count where residuals (W, N) are correlated in time.

    1 for white noise, never less; where something unmodelled is left, neighbouring samples repeat
    each other. `states` start states (2J) were free in each window.
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
    ratio = (residual**2).sum(axis=-1) / chdtri(degrees(residual, states), 1.0 - quantile)
    return float(np.quantile(ratio, quantile))


def measured(residual: Array) -> Array:
    """Which residuals say something: of what was not measured they are 0 but for rounding."""
    return np.asarray(np.abs(residual) > np.sqrt(np.finfo(float).eps))


def degrees(residual: Array, states: int) -> Array:
    """Degrees of freedom in each window of residuals (W, N), `states` of them free, 1 at least."""
    return np.asarray(np.maximum(measured(residual).sum(axis=-1) - states, 1))


def loss(
    residual: Array, channels: int, numerics: Numerics, typical: Array | None = None
) -> Array:
    """Loss of each window [nats], (..., W).

    In each window each channel has its own size of what the model is off by, the most likely one
    beyond what noise alone may be, spread about a typical one as an inverse gamma variable is. So
    neither windows where every hypothesis is wrong decide, nor those where nothing happens.
    Samples far out are weighed down (Huber's second proposal, 1964: location and size together).
    """
    off, count = size(residual, channels, numerics, typical), residual.shape[-1] // channels
    scaled = (_by_channel(residual, channels) / off).reshape(residual.shape)
    total: Array = huber(numerics.huber, scaled).sum(axis=-1)
    own = np.log(off) + 0.5 * _noise_beyond(count, numerics) * (1.0 - off**-2.0)
    if typical is not None:
        apart = np.log(off / typical) + 0.5 * ((typical / off) ** 2 - 1.0)
        own = own + numerics.shared * apart
    return total + count * own.sum(axis=(-2, -1))


def robust_weight(
    residual: Array, channels: int, numerics: Numerics, typical: Array | None = None
) -> Array:
    """Weight of each sample, (..., W, N): of the parabola that touches `loss` there."""
    samples, off = _by_channel(residual, channels), size(residual, channels, numerics, typical)
    return (huber_weight(samples / off, numerics.huber) / off**2).reshape(residual.shape)


def unexplained(residual: Array, channels: int, numerics: Numerics) -> Array:
    """What a model that leaves only noise would save in each window [nats], (..., W)."""
    count = residual.shape[-1] // channels
    total: Array = np.log(size(residual, channels, numerics)).sum(axis=(-2, -1))
    return count * total


def promised(
    change: Array, residual: Array, channels: int, numerics: Numerics, typical: Array | None = None
) -> Array:
    """What a change of a residual, of which all counts as noise, costs [nats], (..., W)."""
    count, off = residual.shape[-1] // channels, size(residual, channels, numerics, typical)
    square = ((_by_channel(change, channels) / off) ** 2).mean(axis=-2)
    noisy = size(residual, channels, numerics)[..., 0, :] == 1.0
    beyond = np.where(noisy, _noise_beyond(count, numerics), 0.0)
    more, times = np.maximum(square - beyond, 0.0), size_weight(numerics, typical)
    total: Array = (np.minimum(square, beyond) + times * np.log1p(more / times)).sum(axis=-1)
    return 0.5 * count * total


def size_weight(numerics: Numerics, typical: Array | None) -> float:
    """Weight of all that is known of a size in one window; what that window shows has 1."""
    return 1.0 if typical is None else 1.0 + numerics.shared


def swollen(residual: Array, channels: int, numerics: Numerics, share: float) -> Array:
    """What so much more (mean square) of what is beyond noise would cost [nats], (..., W)."""
    count = residual.shape[-1] // channels
    beyond: Array = (size(residual, channels, numerics) > 1.0).sum(axis=(-2, -1))
    return 0.5 * np.log1p(share) * count * beyond


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


def _by_channel(residual: Array, channels: int) -> Array:
    count = residual.shape[-1] // channels
    return residual.reshape(*residual.shape[:-1], count, channels)


def _noise_beyond(count: int, numerics: Numerics) -> float:
    """How much the mean square of so many samples of noise may be above 1."""
    return float(chdtri(count, numerics.noise_reaches)) / count - 1.0


def huber_weight(residual: Array, knee: float) -> Array:
    """Huber weights: 1 within the knee [sigma], falling as 1/|r| outside."""
    return np.minimum(1.0, knee / np.maximum(np.abs(residual), 1e-12))
