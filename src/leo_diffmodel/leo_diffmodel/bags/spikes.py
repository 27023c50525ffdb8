# SPDX-License-Identifier: Apache-2.0
"""Spikes in a measured rate that its angle does not support, as an encoder's zero makes them.

An encoder that counts one turn jumps by a turn at its zero. A driver that differentiates the
counts says so fast a rate for one sample; the angle, put right elsewhere, knows nothing of it.
"""

import math

import numpy as np
from numpy.lib.stride_tricks import sliding_window_view
from numpy.typing import NDArray

from leo_sim.description.robot import Robot

from .impossible import lengths
from .states import StateLog
from .topic_map import TopicMap
from .types import Floats

SIGMAS = 10.0  # robust standard deviations from the rates around: no noise reaches so far
COUNTS = 5.0  # steps of the rate's resolution: a coarse rate that is right flickers by less
OF_FASTEST = 1.0  # of the joint's fastest rate otherwise: less may be the sensor's noise
UNSUPPORTED = 0.75  # of a spike that the angle must lack: one that is true shows half there
MOST = 0.1  # share of the samples: a wheel has ten to a turn; more is another unit
FEWEST = 20  # samples that say what is usual


def without_spikes(states: StateLog, robot: Robot, _: TopicMap) -> StateLog:
    """Replace spikes of the rates by the slope of the angle, which may still be wrapped."""
    if states.dq is None or len(states.q) < FEWEST:
        return states
    dq, notes = states.dq.copy(), list[str]()
    t = (states.stamp_ns - states.stamp_ns[0]) * 1e-9
    for j, (name, unit) in enumerate(lengths(robot).items()):
        q, rate = states.q[:, j], states.dq[:, j]
        if np.isfinite(rate).all():
            slope, wide = _slopes(t, q, rate)
            at = _spikes(rate, slope, wide)
            dq[at, j] = slope[at]
            if at.size:
                notes.append(_note(name, f'{unit}/s', rate, q, dq[:, j], at, t))
    return states.noted(notes, dq=dq)


def _slopes(t: Floats, q: Floats, rate: Floats) -> tuple[Floats, NDArray[np.bool_]]:
    """Slope of the angle around each sample (T,), and where none is (ends, gaps, breaks)."""
    dt, usual = np.diff(t), _usual(rate)
    step = np.diff(q)
    step -= math.tau * np.round((step - dt * (usual[1:] + usual[:-1]) / 2) / math.tau)
    good = (dt > 0) & (dt < 5 * np.median(dt[dt > 0])) if (dt > 0).any() else dt > 0
    slope, none = np.zeros(len(q)), np.ones(len(q), dtype=bool)
    inner = good[1:] & good[:-1]
    width = np.where(inner, t[2:] - t[:-2], 1.0)
    slope[1:-1], none[1:-1] = (step[1:] + step[:-1]) / width, ~inner
    return slope, none


def _usual(rate: Floats) -> Floats:
    around: Floats = np.median(sliding_window_view(np.pad(rate, 2, 'symmetric'), 5), axis=1)
    return around


def _spikes(rate: Floats, slope: Floats, none: NDArray[np.bool_]) -> NDArray[np.intp]:
    """Samples far from the rates around them and as far from the slope of the angle."""
    usual = _usual(rate)
    off, lacks = rate - usual, rate - slope
    least = max(
        SIGMAS * _sigma(off),
        SIGMAS * _sigma(lacks[~none]),
        COUNTS * _count(rate),
        OF_FASTEST * float(np.abs(usual).max()),
    )
    found = (np.abs(off) > least) & (off * lacks > UNSUPPORTED * np.square(off)) & ~none
    at = np.flatnonzero(found)
    return at if 0 < len(at) <= max(MOST * len(rate), 1) else at[:0]


def _count(rate: Floats) -> float:
    """What a coarse rate goes by, from its usual change and its least value; 0 of a fine one."""
    changes = np.abs(np.diff(rate))
    if not (changes == 0).any() or not changes.any():
        return 0.0
    return float(min(np.median(changes[changes > 0]), np.quantile(np.abs(rate[rate != 0]), 0.05)))


def _sigma(values: Floats) -> float:
    return 1.4826 * float(np.median(np.abs(values - np.median(values)))) if len(values) else 0.0


def _note(
    name: str, unit: str, rate: Floats, q: Floats, mended: Floats, at: NDArray[np.intp], t: Floats
) -> str:
    worst = at[np.abs(rate[at]).argmax()]
    return (
        f'{len(at)} spike{"s" * (len(at) > 1)} in the rate of {name} that its positions do not '
        f'support, up to {rate[worst]:.3g} where they change by {mended[worst]:.3g} {unit} '
        f'({t[worst]:.3f} s)'
        f'{_where(q, mended, at, t)}; their slope taken instead'
    )


def _where(q: Floats, rate: Floats, at: NDArray[np.intp], t: Floats) -> str:
    way = np.abs(rate) * np.gradient(t)  # rad from sample to sample
    near = float(way[at].max())
    angle = np.exp(1j * q[at])
    zero = float(np.angle(angle.mean())) if len(at) > 1 else 0.0
    off = np.abs(np.angle(angle * np.exp(-1j * zero)))
    if off.max() > near or near > 1.0:  # rad: too coarse to say where
        return ''
    turned = float(np.sum(way)) >= math.tau
    return f', once a turn at {zero:.2f} rad' if turned else f', all at {zero:.2f} rad'
