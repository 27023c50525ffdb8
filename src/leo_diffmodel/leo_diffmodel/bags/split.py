# SPDX-License-Identifier: Apache-2.0
"""Where states break, so that no window crosses a reset, a restart or a gap; wrapped angles."""

from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from leo_msgs_py.bag_contents import TopicLog
from leo_msgs_py.errors import UserError

from .states import deserialize, StateLog
from .types import Floats, UINT32

GAP_PERIODS = 5.0
GAP_SECONDS = 0.025
JUMP_FLOOR = 0.02  # smallest step [rad or m] taken for a jump: above any encoder's resolution
CLEAR_TURN = np.pi / 2
"""rad: where positions and velocities disagree by more from sample to sample (degrees that are
taken for radians), no whole turn can be seen."""
CLOCK_SET_NS = 1_000_000_000  # publish times that go back by more: a clock was set
_JUMP_SIGMAS = 10.0
_NEAR = 3


@dataclass(frozen=True)
class Segments:
    slices: tuple[slice, ...]
    breaks: dict[str, int]  # how often each kind of break came
    set_back: NDArray[np.int64]  # steps in which stamps go back without a new episode, shape (N,)


def split(states: StateLog, episodes: TopicLog | None) -> Segments:
    """Cut at new episodes, at stamps jumping back, at gaps, and at jumps where none is told.

    A gap is a step longer than five median periods (and 25 ms). A jump is a position change that
    the velocities at both ends do not allow, by more than ten robust standard deviations of such
    mismatches and 0.02 rad.
    """
    step = np.diff(states.stamp_ns)
    back = step <= 0
    forward = step[~back]
    period = float(np.median(forward)) if forward.size else 0.0
    gap = step > max(GAP_PERIODS * period, GAP_SECONDS * 1e9)
    cuts = {'stamps jump back': back, 'gap': gap & ~back}
    mismatch = np.zeros(len(step))
    if len(step):
        residual, tolerance, _ = _mismatch(states)
        mismatch = (np.abs(residual) / tolerance).max(axis=1)  # 1 is what velocities allow
    if episodes is not None and episodes.messages:
        broken = back | gap | (mismatch > 1.0)
        cuts['new episode'] = _episode_cuts(states, episodes, broken, mismatch)
        for kind in ('gap', 'stamps jump back'):
            cuts[kind] &= ~cuts['new episode']
    else:
        cuts['jump'] = (mismatch > 1.0) & ~back & ~gap
    breaks = {k: int(v.sum()) for k, v in cuts.items()}
    set_back = np.flatnonzero(cuts['stamps jump back'] & (step < 0))
    return Segments(_slices(cuts, len(states.q)), breaks, set_back)


def unwrapped(states: StateLog, *_: object) -> StateLog:
    if len(states.q) < 2:
        return states
    residual, tolerance, impulse = _mismatch(states)
    turns = np.round(residual / (2.0 * np.pi))
    wrapped = (turns != 0) & (np.abs(residual - 2.0 * np.pi * turns) <= tolerance)
    wrapped &= (impulse <= JUMP_FLOOR) & (tolerance < CLEAR_TURN)
    if not wrapped.any():
        return states
    shift = np.cumsum(np.where(wrapped, turns, 0.0), axis=0) * 2.0 * np.pi
    q = states.q - np.vstack([np.zeros(states.q.shape[1]), shift])
    return states.noted([f'{wrapped.sum()} wraps by whole turns undone'], q=q)


def _mismatch(states: StateLog) -> tuple[Floats, Floats, Floats]:
    """Return position change less velocity x dt, its tolerance, and velocity change x dt."""
    dt = np.abs(np.diff(states.stamp_ns))[:, None] * 1e-9
    rough = _roughness(np.diff(states.q, axis=0))
    dq = np.full_like(states.q, np.nan) if states.dq is None else states.dq
    unknown = np.isnan(dq[1:] + dq[:-1])
    moved = np.diff(states.q, axis=0) - dt * (dq[1:] + dq[:-1]) / 2.0
    residual = np.where(unknown, rough, moved)
    impulse = np.where(unknown, 0.0, dt * np.abs(np.diff(dq, axis=0)))
    sigma = 1.4826 * np.median(np.abs(residual - np.median(residual, axis=0)), axis=0)
    return residual, np.maximum(JUMP_FLOOR, _JUMP_SIGMAS * sigma) + impulse, impulse


def _roughness(change: Floats) -> Floats:
    """Return each position change less the one before or after, whichever is closer."""
    before = change - np.vstack([change[:1], change[:-1]])
    after = change - np.vstack([change[1:], change[-1:]])
    edge = np.zeros(len(change), dtype=bool)
    edge[[0, -1]] = len(change) > 2
    smaller = np.where(np.abs(before) < np.abs(after), before, after)
    return np.where(edge[:, None], before + after, smaller)


def _episode_cuts(
    states: StateLog, episodes: TopicLog, breaks: NDArray[np.bool_], mismatch: Floats
) -> NDArray[np.bool_]:
    """Return the steps, shape (T - 1,), in which the episode number changes.

    The time at which an episode number was published says between which states. Without such
    times, or where the clock was set, only its arrival is known, a few samples before or after:
    the worst jump nearby is the true place.
    """
    logged = list(deserialize(episodes, UINT32))
    numbers = [message.data for _, message in logged]
    set_meanwhile = (np.diff(states.published_ns) < -CLOCK_SET_NS).any()
    order = 'log_ns' if set_meanwhile else 'published_ns'
    starts = [
        getattr(message, order)
        for k, (message, _) in enumerate(logged)
        if k and numbers[k] != numbers[k - 1]
    ]
    cuts = np.zeros(max(len(states.q) - 1, 0), dtype=bool)
    for place in np.searchsorted(getattr(states, order), starts) - 1:
        if 0 <= place < cuts.size:
            low = max(place - _NEAR, 0)
            near = mismatch[low : place + _NEAR + 1]
            moved = near.max() > 1.0 and not breaks[place]
            cuts[low + int(near.argmax()) if moved else place] = True
    return cuts


def _slices(cuts: dict[str, NDArray[np.bool_]], count: int) -> tuple[slice, ...]:
    anywhere = np.logical_or.reduce(list(cuts.values()))
    edges = [0, *(np.flatnonzero(anywhere) + 1).tolist(), count]
    found = [slice(a, b) for a, b in pairwise(edges) if b - a >= 2]
    if not found:
        raise UserError(f'only {count} usable joint states, never two in a row; record longer')
    return tuple(found)
