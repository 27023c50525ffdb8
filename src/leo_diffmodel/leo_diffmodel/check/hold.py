# SPDX-License-Identifier: Apache-2.0
"""When does an input act: from its stamp on, or over the period before it?"""

from dataclasses import dataclass, replace

import numpy as np
from scipy.special import huber

from leo_diffmodel.bags.mend import with_inputs_late
from leo_diffmodel.bags.recording import Recording
from leo_diffmodel.bags.types import at_rows
from leo_diffmodel.check.settings import CHECK
from leo_diffmodel.compare.pushes import flat_and_ramp, respond, small_torques, whitened
from leo_diffmodel.compare.settings import COMPARE
from leo_diffmodel.compare.sizes import torque_scale
from leo_diffmodel.compare.windows import Array, cut, spread_out, Windows
from leo_diffmodel.explain.problem.likelihood import huber_weight
from leo_diffmodel.explain.settings import SETTINGS
from leo_diffmodel.outside.finding import ERROR, Finding, OK
from leo_sim.model import Model

MEANING = {'next': 'from its stamp on', 'previous': 'over the period before its stamp'}


@dataclass(frozen=True)
class Misfit:
    start: Array  # of each window [s], (W,)
    loss: Array  # without what is free [nats], (W,)
    error: Array  # measured less predicted, over the noise, (W, K)
    columns: Array  # what the free states and torques do to it, (W, K, F)


def hold(
    recording: Recording, other: Recording | None, hold_now: str, model: Model, sigma: Array
) -> list[Finding]:
    """Which way of holding the inputs the data support, by noise (2J,).

    `recording` was read as `hold_now` says, `other` the other way; None leaves the question out.
    """
    if other is None or recording.input == 'none':
        return []
    ahead = preference(recording, other, model, sigma)
    if ahead < -CHECK.hold_nats and _agrees(recording, hold_now, model, sigma):
        right = 'previous' if hold_now == 'next' else 'next'
        what = f'an input acts {MEANING[right]}, not {MEANING[hold_now]}: '
        what += f'that fits better by {-ahead:.0f} nats'
        todo = f'put "hold: {right}" into the topic map (--topic-map MAP.yaml)'
        return [Finding('hold', ERROR, what, todo)]
    if ahead > CHECK.hold_nats:
        what = f'an input acts {MEANING[hold_now]}, as read: that fits better by {ahead:.0f} nats'
    else:
        what = f'whether an input acts {MEANING["next"]} or {MEANING["previous"]} makes no '
        what += f'difference that shows here ({ahead:.0f} nats)'
    return [Finding('hold', OK, what)]


def _agrees(recording: Recording, hold_now: str, model: Model, sigma: Array) -> bool:
    """Whether inputs moved half a command the way that the other reading says fit better, too."""
    half = 0.5 * recording.command_period
    moved = shifted(recording, -half if hold_now == 'next' else half)
    before, after = (misfit(r, model, sigma).loss.sum() for r in (recording, moved))
    return bool(after < before)


def preference(recording: Recording, other: Recording, model: Model, sigma: Array) -> float:
    """Nats by which the bag as read beats the bag read the other way, on the same windows.

    0 where the difference is small against what the model lacks anyway.
    """
    read, way = (misfit(r, model, sigma) for r in (recording, other))
    starts = np.round(read.start, 6), np.round(way.start, 6)
    _, first, second = np.intersect1d(*starts, return_indices=True)
    if not len(first):
        return 0.0
    read, way = at_rows(read, first), at_rows(way, second)
    if _removed(read.loss, way.loss, model) < CHECK.hold_least:
        return 0.0
    usual = float(np.median(np.minimum(read.loss, way.loss)))
    excess = max(1.0, usual / _expected(model))  # of white noise, so that nats stay odds
    return _nats(way.loss - read.loss, _apart(read, way), excess)


def _apart(read: Misfit, way: Misfit) -> Array:
    """How far two predictions are apart beyond what is free, in squares of the noise, (W,)."""
    apart = read.error - way.error
    free = read.columns @ (np.linalg.pinv(read.columns, 1e-7) @ apart[..., None])
    return np.square(apart - free[..., 0]).sum(axis=-1)


def _nats(spared: Array, apart: Array, excess: float) -> float:
    """Log odds of two readings from the loss that the first spares in each window.

    With white noise it spares half of `apart` where it is right, and as much less where the other
    is, with the variance `apart`. Noise that a controller feeds back into the input favours a
    reading in every window, however little they differ in it, so that this much is free.
    """
    weight = 1 / (apart + 1)
    beyond = apart - float(weight @ apart) / float(weight.sum())
    return float((weight * beyond) @ spared) / excess


def _removed(loss: Array, other: Array, model: Model) -> float:
    """Share of the misfit beyond noise that the better of two losses (W,) spares, 0 to 1."""
    low, high = sorted((float(loss.sum()), float(other.sum())))
    beyond = high - len(loss) * _expected(model)
    return (high - low) / beyond if beyond > high - low else 1.0


def _expected(model: Model) -> float:
    """Loss of a window in which only noise is left [nats]."""
    joints = len(model.robot.joint_names)
    channels = 2 * joints * (CHECK.hold_intervals + 1)
    free = 4 * joints + len(model.robot.actuators)
    return 0.5 * (channels - free)


def shifted(recording: Recording, seconds: float) -> Recording:
    """The recording with its inputs acting `seconds` later (earlier where negative)."""
    late = [seconds] * len(recording.actuators)
    episodes = tuple(with_inputs_late(e, late) for e in recording.episodes)
    return replace(recording, episodes=episodes)


def misfit(recording: Recording, model: Model, sigma: Array) -> Misfit:
    """Robust loss of short windows with free start states and free missing torques.

    Torques that are constant, that grow in time and that go along with the input are free at each
    joint, so that what the model lacks does not pass for an input at the wrong time.
    """
    seconds = CHECK.hold_intervals * recording.state_period
    most = CHECK.hold_windows_on_ground if model.robot.contacts else CHECK.hold_windows
    windows = spread_out(cut([recording], seconds, history=COMPARE.history), most)
    predicted, columns = respond(model, windows, windows.measured[:, 0], _torques(model, windows))
    error, columns = whitened(windows.measured - predicted, columns, sigma)
    loss = huber(SETTINGS.numerics.huber, _without(error, columns)).sum(axis=-1)
    return Misfit(windows.start, loss, error, columns)


def _torques(model: Model, windows: Windows) -> Array:
    """Small torques at each joint: constant, a ramp, and along each input, (B, W, K, J)."""
    free = small_torques(model, windows, *flat_and_ramp(windows))
    size = COMPARE.small_torque * torque_scale(model.robot)
    peak = np.maximum(np.abs(windows.inputs).max(axis=(0, 1)), 1e-12)
    along = np.moveaxis(windows.inputs / peak, -1, 0)
    at = np.eye(windows.q.shape[-1])[list(model.robot.actuated)]
    return np.concatenate([free, size * (along[..., None] * at[:, None, None])])


def _without(e: Array, a: Array) -> Array:
    """Residuals without what the columns explain, twice: the second time outliers weigh less."""
    weight = np.ones_like(e)
    for _ in range(2):
        root = np.sqrt(weight)[..., None]
        rest = e - (a @ (np.linalg.pinv(a * root, 1e-7) @ (e[..., None] * root)))[..., 0]
        weight = huber_weight(rest, SETTINGS.numerics.huber)
    return rest
