# SPDX-License-Identifier: Apache-2.0
"""How well the motion of a joint predicts its logged input where the fit has not looked.

The input as logged is what is predicted, from the motion, the model and all ordinary effects
(`outside.ordinary`). It is never what others are predicted from: a factor of a noisy column is
too small (errors in variables), the more so where friction takes most of it.
"""

from collections.abc import Iterable
from dataclasses import dataclass, replace

import numpy as np

from leo_diffmodel.faults.settings import LIMITS
from leo_diffmodel.outside.flow import Flow
from leo_diffmodel.outside.ordinary import explained, ordinary
from leo_diffmodel.outside.samples import Array
from leo_diffmodel.outside.settings import OUTSIDE


@dataclass(frozen=True)
class Reading:
    unit: float = 1.0  # what it says where 1 N m or N acts
    column: int | None = None  # whose input is in its place; its own where None
    share: float = 0.0  # of the weight that something besides carries


AS_LOGGED = Reading()
TINY = 1e-12


def rest(flow: Flow, j: int, fitted: Array, reading: Reading = AS_LOGGED) -> Array:
    """What of the input of joint j its motion does not explain [N m, N as logged], (N,).

    `fitted` are the instants that are fitted, (N,).
    """
    column = j if reading.column is None else reading.column
    motor, before, missing = flow.motor.copy(), flow.before.copy(), flow.missing.copy()
    motor[:, j] = flow.motor[:, column] / reading.unit
    before[:, :, j] = flow.before[:, :, column] / reading.unit
    missing[:, j] += flow.motor[:, j] - motor[:, j] + reading.share * flow.load[:, j]
    acting = replace(flow, motor=motor, before=before, missing=missing)
    return reading.unit * explained(acting, j, fitted, ordinary(acting, j)).rest


def misses(flow: Flow, j: int, reading: Reading = AS_LOGGED) -> Array:
    """Mean size of the rest of joint j in blocks of time, each by a fit of the others, (B,).

    No instant that shares a bell with the block is fitted. NaN in blocks without motion.
    """
    moving = flow.moving[:, j] > LIMITS.moving
    block = _blocks(len(flow.time))
    out = np.full(LIMITS.blocks, np.nan)
    for b in range(LIMITS.blocks):
        near = np.convolve(block == b, np.ones(2 * OUTSIDE.per_bell + 1), mode='same') > 0.5
        left, fitted = moving & (block == b), moving & ~near
        if left.any() and fitted.sum() >= LIMITS.fewest_instants:
            out[b] = float(np.abs(rest(flow, j, fitted, reading)[left]).mean())
    return out


def better(first: Iterable[Array], second: Iterable[Array]) -> float:
    """By how much less the second misses than the first, in standard errors over the blocks.

    Each block of each joint (B,) counts alike, however much moves in it.
    """
    a, b = np.array([*first]), np.array([*second])
    known = np.isfinite(a) & np.isfinite(b)
    apart = 2 * (a - b)[known] / np.maximum(a + b, TINY)[known]
    if len(apart) < 2:
        return 0.0
    return float(apart.mean() / max(apart.std(ddof=1) / np.sqrt(len(apart)), TINY))


def mean(missed: Array) -> float:
    """Of blocks (..., B), those without motion left out; infinite where there is no other."""
    known = missed[np.isfinite(missed)]
    return float(known.mean()) if known.size else float('inf')


def split(values: Array) -> Array:
    """Means of values (N,) in the same number of equal blocks (B,); NaN in empty ones."""
    with np.errstate(all='ignore'):
        number = _blocks(len(values))
        sums, counts = (np.bincount(number, w, LIMITS.blocks) for w in (values, None))
        return sums / counts


def _blocks(count: int) -> Array:
    """Number of the block of each of so many values in order of time."""
    return np.arange(count) * LIMITS.blocks // max(count, 1)
