# SPDX-License-Identifier: Apache-2.0
"""Forces from outside: shoves and collisions, blocked joints, hands that hold the robot."""

import warnings

import numpy as np
from scipy.ndimage import maximum_filter1d
from scipy.spatial import cKDTree

from leo_diffmodel.bags.recording import Episode, Recording
from leo_diffmodel.outside.finding import ERROR, Finding, WARNING
from leo_diffmodel.outside.flow import Flow, still_rates
from leo_diffmodel.outside.ordinary import Ordinary
from leo_diffmodel.outside.samples import Array, runs, spread
from leo_diffmodel.outside.settings import OUTSIDE
from leo_sim.model import Model

TODO = {
    'push': 'a hand, a stop or a cable? cut it out: leo bag cut --without-outside',
    'hand': 'a hand is in no model: record again with nothing but the motors moving it',
    'blocked': 'free the joint and record again, or cut it out: leo bag cut --without-outside',
    'unexplained': 'are columns, units and signs of the inputs right? leo explain asks effects',
    'held': 'nothing: leo explain leaves it out',
}
HELD = 'all joints: stand before the first input where the model would move; held by a hand?'


def stretch(kind: str, why: str, begin: float, end: float) -> Finding:
    """A stretch [s] in which something else than its motors moves or holds the robot."""
    return Finding(kind, ERROR if kind == 'hand' else WARNING, why, TODO[kind], ((begin, end),))


def bursts(flow: Flow, rest: Array, j: int, fitted: Array) -> list[Finding]:
    """What stands out of the torque left over at joint j (N,).

    It must do so twice: out of what is left over elsewhere, and out of what is left over in states
    and under inputs like those, so that an unknown law of angle and speed is no push.
    """
    limit = _limit(flow, j, spread(rest[fitted]), fitted)
    out = (np.abs(rest) > limit) & (flow.moving[:, j] > OUTSIDE.burst_moving)
    if not out.any():
        return []
    both = _surely(flow, rest, j, np.abs(rest) > OUTSIDE.burst_wide * limit)
    sure = out & (both > limit)
    wide = runs(both > OUTSIDE.burst_wide * limit, flow.episode)
    long = (run for run in wide if sure[run].sum() >= OUTSIDE.burst_instants)
    return [_burst(flow, rest, j, run, float(both[run].max())) for run in long]


def _burst(flow: Flow, rest: Array, j: int, run: Array, size: float) -> Finding:
    half, force = 0.25 * flow.bell, f'{size:.2g} {flow.unit(j)}'
    begin, end = float(flow.time[run[0]]) - half, float(flow.time[run[-1]]) + half
    if _stops(flow, rest, j, run):
        hit = 'its own stop' if _at_own_stop(flow, j, run) else 'something that stops it'
        kind, why = 'blocked', f'hits {hit} with {force}'
    elif end - begin > OUTSIDE.lasting:
        kind, why = 'hand', f'is led by a hand or a cable with up to {force}'
    else:
        kind, why = 'push', f'is pushed with up to {force}'
    return stretch(kind, f'{flow.joint(j)}: {why}', begin, end)


def _at_own_stop(flow: Flow, j: int, run: Array) -> bool:
    """Whether the joint is near one of the stops that the robot file gives it."""
    stops = flow.motion.model.laws.stops
    ends = np.array([s[j] for s in stops or ()])
    near = OUTSIDE.own_stop * np.ptp(ends) if np.isfinite(ends).all() and len(ends) else 0.0
    return bool((np.abs(flow.q[run, j] - ends[:, None]) < near).any())


def _limit(flow: Flow, j: int, usual: float, fitted: Array) -> Array:
    own = flow.own[:, j]
    step = float(np.median(np.diff(flow.time)))
    half = max(1, round(OUTSIDE.burst_around / max(step, 1e-9)))
    nearby = OUTSIDE.burst_local * maximum_filter1d(own, 2 * half + 1, mode='nearest')
    often = OUTSIDE.burst_usual * float(np.quantile(own[fitted], 0.9))
    return np.asarray(OUTSIDE.burst_sigmas * usual + np.maximum(nearby, often))


def _surely(flow: Flow, rest: Array, j: int, wanted: Array) -> Array:
    """How far each wanted instant stands out of everything that was alike (N,), the least."""
    one = [flow.q[:, j], flow.dq[:, j], flow.sign[:, j]]
    before = np.swapaxes(flow.before, 1, 2).reshape(len(rest), -1)
    whole = [*flow.q.T, *flow.dq.T, *flow.sign.T, *flow.motor.T, *flow.enabled.T, *before.T]
    joints = flow.q.shape[1]
    least = np.where(wanted, np.abs(rest), 0.0)
    for features, angles in ((one, 1), (whole, joints)):
        turns = [f(x) for x in features[:angles] for f in (np.sin, np.cos)]
        columns = np.stack([*turns, *features[angles:]], axis=1)
        alone = rest - _typical(flow.time, rest, columns, wanted)
        least = np.minimum(least, np.where(rest * alone > 0, np.abs(alone), 0.0))
    return least


def _typical(time: Array, rest: Array, features: Array, wanted: Array) -> Array:
    """Median of the rest where the features were most alike at other times; 0 if unwanted."""
    features = features / np.maximum(features.std(axis=0), 1e-9)
    known = np.unique(np.linspace(0, len(rest) - 1, OUTSIDE.neighbours_among).astype(int))
    count = min(4 * OUTSIDE.neighbours, len(known))
    near = known[cKDTree(features[known]).query(features[wanted], k=count)[1]]
    apart = np.abs(time[near] - time[wanted][:, None]) > OUTSIDE.neighbours_apart
    first = apart & (np.cumsum(apart, axis=1) <= OUTSIDE.neighbours)
    out = np.zeros(len(rest))
    with warnings.catch_warnings():
        warnings.simplefilter('ignore', RuntimeWarning)
        out[wanted] = np.nan_to_num(np.nanmedian(np.where(first, rest[near], np.nan), axis=1))
    return out


def _stops(flow: Flow, rest: Array, j: int, run: Array) -> bool:
    """Whether the torque opposes the motion, ends it, and the joint is where it turns back."""
    low, high = flow.q[:, j].min(), flow.q[:, j].max()
    at, first = flow.q[run, j], max(run[0] - 1, 0)
    last = min(run[-1] + 1, len(rest) - 1)
    peak = run[np.argmax(np.abs(rest[run]))]
    before, after = flow.dq[first, j], flow.dq[last, j]
    edge = OUTSIDE.stop_edge * (high - low)
    outmost = at.max() > high - edge if before > 0 else at.min() < low + edge
    ends = after * before < OUTSIDE.stop_rest * before**2
    return bool(outmost and rest[peak] * before < 0 and ends)


def blocked(flow: Flow, found: Ordinary, j: int, fitted: Array) -> list[Finding]:
    """Stretches in which joint j is blocked: motor and weight push, and it stands.

    They push far harder than friction takes in the `fitted` instants (N,), and than elsewhere.
    """
    pushed = np.abs(flow.motor[:, j] + flow.load[:, j])
    driven = flow.motor[:, j] * (flow.motor[:, j] + flow.load[:, j]) > 0
    friction = np.abs(found.friction[fitted])
    least = OUTSIDE.blocked_frictions * float(np.quantile(friction, 0.75))
    least += OUTSIDE.blocked_share * float(np.quantile(flow.own[fitted, j], 0.9))
    time, stands = flow.time, flow.moving[:, j] < OUTSIDE.stands
    least_seconds = OUTSIDE.standing_seconds
    long = [r for r in runs(stands, flow.episode) if time[r[-1]] - time[r[0]] > least_seconds]
    sizes = np.array([float(np.quantile(pushed[run], 0.75)) for run in long])
    out = []
    for i, run in enumerate(long):
        others = np.delete(sizes, i).max(initial=0.0)
        limit = least if driven[run].mean() > 0.5 else OUTSIDE.blocked_undriven * least
        hard = sizes[i] > max(limit, OUTSIDE.blocked_elsewhere * others)
        hard &= float(np.quantile(np.abs(found.rest[run]), 0.75)) > OUTSIDE.blocked_left * sizes[i]
        begin, end = float(time[run[0]]), float(time[run[-1]])
        if hard and end - begin > OUTSIDE.blocked_seconds:
            at = ' at its own stop' if _at_own_stop(flow, j, run) else ''
            force = f'{sizes[i]:.2g} {flow.unit(j)}'
            why = f'{flow.joint(j)}: stands{at} while motor and weight push with {force}'
            out.append(stretch('blocked', why, begin, end))
    return out


def held(recording: Recording, model: Model) -> list[Finding]:
    """What comes before the first input where somebody may hold the robot.

    All joints stand without input in a pose that the model as given leaves: a hand holds the
    robot, or static friction does. None where goals hold the robot, or where it stands all along.
    """
    if recording.input == 'position':
        return []
    still, free = still_rates(recording), model.changed(held=recording.held)
    found = [(e, _acts(e, still)) for e in recording.episodes]
    if not any(acts.any() for _, acts in found):
        return []
    ends = [(e, int(np.argmax(acts)) if acts.any() else len(acts) - 1) for e, acts in found]
    return [
        stretch('held', HELD, float(e.t[0]), float(e.t[end]))
        for e, end in ends
        if end and _would_move(e, end, free)
    ]


def _acts(e: Episode, still: Array) -> Array:
    """In which samples a joint moves or a motor gets something, (T,)."""
    return np.asarray((np.abs(e.dq) > still).any(axis=1) | (e.inputs != 0).any(axis=1))


def _would_move(e: Episode, end: int, model: Model) -> bool:
    """Whether the model leaves the angles that are measured there."""
    angles = e.q[:end]
    state = model.state_from(angles.mean(axis=0), np.zeros_like(angles[0]))
    away, nothing = np.zeros_like(angles[0]), np.zeros(e.inputs.shape[1])
    step = OUTSIDE.held_ahead / OUTSIDE.held_steps
    for _ in range(OUTSIDE.held_steps):
        state = model.step(state, nothing, step, enabled=e.enabled[0])
        away = np.maximum(away, np.abs(model.sense(state)[0] - angles.mean(axis=0)))
    return bool((away > OUTSIDE.held_moved + OUTSIDE.held_sigmas * angles.std(axis=0)).any())
