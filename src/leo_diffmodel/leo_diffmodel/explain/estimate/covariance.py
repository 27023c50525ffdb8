# SPDX-License-Identifier: Apache-2.0
"""Covariance of fitted parameters that holds where the model is wrong.

Columns are the sensitivity of the whitened residual (W, N) to the parameters, shape (W, N, P);
`channels` and `typical` as in `likelihood`.
"""

import numpy as np
from scipy.special import stdtrit

from leo_diffmodel.compare.windows import Array
from leo_diffmodel.explain.problem import likelihood
from leo_diffmodel.explain.problem.problem import Problem
from leo_diffmodel.explain.settings import Numerics


def conditional_errors(columns: Array) -> Array:
    """Standard error of each parameter with the others fixed, (P,); inf where none shows."""
    size = np.sqrt((columns**2).sum(axis=(0, 1)))
    return np.divide(1.0, size, out=np.full(size.shape, np.inf), where=size > 0)


def covariance(
    columns: Array,
    residual: Array,
    block: Array,
    prior: Array,
    spread: float,
    channels: int,
    numerics: Numerics,
    typical: Array | None = None,
    larger: bool = False,
) -> Array:
    """Covariance of the parameters that holds where the model is wrong, shape (P, P).

    The sandwich H^-1 J H^-1 (Godambe 1960, White 1982): H the curvature of the loss, J the
    covariance of its slope between time blocks (Liang and Zeger 1986) with the correction
    B / (B - 1). Of few blocks J is itself uncertain, so it is averaged with what size and
    correlation of the residual give, and widened by Student's t.

    Args:
        columns: shape (W, N, P).
        residual: whitened residual, shape (W, N).
        block: stretch of time of each window, shape (W,).
        prior: precision of each parameter before these data, shape (P,); inf for what is held.
        spread: times nats count less, see `likelihood.dispersion`.
        channels: how many there are, 2J.
        numerics: of the loss, and how much it may bend the other way.
        typical: size of each in most windows.
        larger: each variance is the larger of the two, not their mean. Blocks say more where the
            model is wrong, and at times less by chance, as they are few.
    """
    slopes, touching = derivatives(columns, residual, channels, numerics, typical)
    bent = _bent(slopes, residual, numerics, typical)
    times = few_blocks(block)
    known = spread * times * known_before(prior)
    inverse = _inverse(touching.sum(axis=0) + known, bent, np.isfinite(prior), numerics.most_bent)
    _, number = np.unique(block, return_inverse=True)
    of_block = np.zeros((int(number.max()) + 1, prior.size))
    np.add.at(of_block, number, slopes.sum(axis=1))
    count = len(of_block)
    spreads = of_block.T @ of_block * count / max(count - 1, 1) + spread * known
    sandwich = inverse @ spreads @ inverse
    mixed = 0.5 * (sandwich + spread * inverse)
    if larger:
        most = np.maximum(np.diagonal(sandwich), spread * np.diagonal(inverse))
        own = np.diagonal(mixed)
        scale = np.sqrt(np.divide(most, own, out=np.ones_like(own), where=own > 0))
        mixed = mixed * np.outer(scale, scale)
    return mixed * times


def few_blocks(block: Array) -> float:
    """By how much variances that few blocks give are to be larger, by Student's t."""
    return float((stdtrit(max(len(np.unique(block)) - 1, 1), 0.975) / 1.96) ** 2)


def derivatives(
    columns: Array,
    residual: Array,
    channels: int,
    numerics: Numerics,
    typical: Array | None = None,
) -> tuple[Array, Array]:
    """Slope of the loss by window and channel, (W, 2J, P); curvature that touches, (W, P, P)."""
    weight = likelihood.robust_weight(residual, channels, numerics, typical)
    weighed = columns * weight[..., None]
    touching = np.einsum('wnp,wnq->wpq', weighed, columns, optimize=True)
    shape = len(residual), residual.shape[-1] // channels, channels, columns.shape[-1]
    return (weighed * residual[..., None]).reshape(shape).sum(axis=1), touching


def _bent(slopes: Array, residual: Array, numerics: Numerics, typical: Array | None) -> Array:
    """What the loss bends less than the parabola that touches it, (P, P).

    The size answers to the parameters, too: the observed information (Efron and Hinkley 1978).
    """
    channels = slopes.shape[1]
    off = slopes[likelihood.size(residual, channels, numerics)[:, 0] > 1.0]
    weight = likelihood.size_weight(numerics, typical)
    return 2.0 * channels / (weight * residual.shape[-1]) * off.T @ off


def _inverse(touching: Array, bent: Array, free: Array, most_bent: float) -> Array:
    """Inverse of the curvature over the free parameters, huge along what the data do not show.

    Where windows contradict each other, at most `most_bent` is taken off a direction.
    """
    scale = np.sqrt(np.maximum(np.diag(touching), 1e-30))
    part, outer = np.ix_(free, free), np.outer(scale, scale)
    values, vectors = np.linalg.eigh((touching / outer)[part])
    root = vectors / np.sqrt(np.maximum(values, 1e-12))
    shares, turned = np.linalg.eigh(root.T @ (bent / outer)[part] @ root)
    root = root @ turned / np.sqrt(1.0 - np.minimum(shares, most_bent))
    inverse = np.zeros_like(touching)
    inverse[part] = root @ root.T
    return inverse / outer


def known_before(prior: Array) -> Array:
    """Curvature by what is known before: the precisions, 0 for what is held, shape (P, P)."""
    return np.diag(np.where(np.isfinite(prior), prior, 0.0))


def beyond(
    matrix: Array, descent: Array, prior: Array, room: Array, spread: float, numerics: Numerics
) -> Array:
    """How far parameters may move down and up with constants that are on a bound, shape (P, 2).

    Such a constant is moved inside, the free parameters making up for it, until the loss rises as
    much as at the end of a 95 % interval, or to its other bound; several add in quadrature.
    `matrix` (P, P) and `descent` (P,) are curvature and downhill slope of the loss, `prior` and
    `room` (P,) as of a `Hypothesis`, `spread` the times variances are larger than of white noise.
    """
    moved, matrix = np.zeros((len(room), 2)), matrix + spread * known_before(prior)
    shown = np.isfinite(prior) & (np.diagonal(matrix) > 0)
    for i in np.flatnonzero(room):
        way = np.zeros(len(room))
        way[i] = np.sign(room[i])
        if shown.any():
            part = matrix[np.ix_(shown, shown)]
            way[shown] = -solved(part, matrix[shown] @ way, numerics.least_damping)
        rise, bend = (max(float(x), 0.0) for x in (-descent @ way, way @ matrix @ way))
        most, there = 1.96**2 * spread, abs(float(room[i]))
        cost = rise + np.sqrt(rise**2 + bend * most)
        far = min(there, most / cost) if cost > 0 else there
        moved += np.stack([np.minimum(far * way, 0.0), np.maximum(far * way, 0.0)], axis=1) ** 2
    return np.sqrt(moved)


def solved(gram: Array, slope: Array, damping: float) -> Array:
    """The damped solution of the normal equations; parameters are scaled to a unit diagonal."""
    scale = np.sqrt(np.maximum(np.diagonal(gram), 1e-300))
    damped = gram / np.outer(scale, scale) + damping * np.eye(len(scale))
    return np.asarray(np.linalg.solve(damped, slope / scale) / scale)


def leverage_weight(problem: Problem, by_theta: Array) -> Array:
    """Weight of each window that limits its leverage on the parameters (Mallows), (W, 1, 1).

    A contact that comes or goes with a small change of a parameter makes a window many times as
    sensitive to it as it is to a larger change.
    """
    numerics = problem.numerics
    if not np.isfinite(numerics.most_leverage) or not by_theta.size:
        return np.ones((len(by_theta), 1, 1))
    size = np.sqrt((by_theta**2).sum(axis=1))
    responding = size >= numerics.responding * np.quantile(size, 0.9, axis=0)
    typical = [np.median(s[a]) for s, a in zip(size.T, responding.T, strict=True)]
    most = numerics.most_leverage * np.array(typical)
    return np.where(size > most, most / np.maximum(size, 1e-12), 1.0).min(axis=1)[:, None, None]
