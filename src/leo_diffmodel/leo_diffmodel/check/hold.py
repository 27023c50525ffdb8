# SPDX-License-Identifier: Apache-2.0
"""When does an input act: from its stamp on, or over the period before it?"""

from __future__ import annotations

import numpy as np

from leo_diffmodel.bags.recording import Recording
from leo_diffmodel.check.finding import ERROR, Finding, OK
from leo_diffmodel.check.shift import INTERVALS, misfit, shifted
from leo_sim.model import Model

Array = np.ndarray
DECISIVE_NATS = 10.0
TRIFLE = 0.05
OTHER = {'next': 'previous', 'previous': 'next'}
MEANING = {'next': 'from its stamp on', 'previous': 'over the period before its stamp'}


def hold(
    recording: Recording, other: Recording | None, hold_now: str, model: Model, sigma: Array
) -> list[Finding]:
    """Which way of holding the inputs the data support.

    Args:
        recording: the bag as read.
        other: the same bag read the other way; None leaves that question out.
        hold_now: 'next' or 'previous', how `recording` was read.
        model: the model.
        sigma: noise, shape (2J,).
    """
    if other is None or recording.input == 'none':
        return []
    ahead = preference(recording, other, model, sigma)
    if ahead < -DECISIVE_NATS and _agrees(recording, hold_now, model, sigma):
        return [_wrong_way(hold_now, -ahead)]
    return [_right_way(hold_now, ahead)]


def _agrees(recording: Recording, hold_now: str, model: Model, sigma: Array) -> bool:
    """Whether inputs moved half a command the way that the other reading says fit better, too."""
    half = 0.5 * recording.command_period
    moved = shifted(recording, -half if hold_now == 'next' else half)
    before, after = (misfit(r, model, sigma)[1].sum() for r in (recording, moved))
    return bool(after < before)


def preference(recording: Recording, other: Recording, model: Model, sigma: Array) -> float:
    """Nats by which the bag as read beats the bag read the other way, on the same windows.

    0 where the difference is a trifle against what the model lacks anyway.
    """
    (t, loss), (t_other, loss_other) = (misfit(r, model, sigma) for r in (recording, other))
    both, mine, theirs = np.intersect1d(np.round(t, 6), np.round(t_other, 6), return_indices=True)
    if not len(both):
        return 0.0
    a, b = loss[mine], loss_other[theirs]
    if _removed(a, b, model) < TRIFLE:
        return 0.0
    return float((b - a).sum()) / _excess(np.minimum(a, b), model)


def _removed(loss: Array, other: Array, model: Model) -> float:
    """Share of the misfit beyond noise that the better of two losses (W,) spares, 0 to 1."""
    low, high = sorted((float(loss.sum()), float(other.sum())))
    beyond = high - len(loss) * _expected(model)
    return (high - low) / beyond if beyond > high - low else 1.0


def _excess(loss: Array, model: Model) -> float:
    """How many times the loss exceeds that of white noise, so that nats stay odds; 1 or more."""
    return max(1.0, float(np.median(loss)) / _expected(model))


def _expected(model: Model) -> float:
    """Loss of a window in which only noise is left [nats]."""
    joints = len(model.robot.joint_names)
    channels = 2 * joints * (INTERVALS + 1)
    free = 2 * joints + 2 * joints + len(model.robot.actuators)
    return 0.5 * (channels - free)


def _wrong_way(hold_now: str, nats: float) -> Finding:
    right = OTHER[hold_now]
    what = (
        f'an input acts {MEANING[right]}, not {MEANING[hold_now]}: '
        f'that fits better by {nats:.0f} nats'
    )
    todo = f'put "hold: {right}" into the topic map (--topic-map MAP.yaml)'
    return Finding('hold', ERROR, what, (), todo)


def _right_way(hold_now: str, nats: float) -> Finding:
    if nats > DECISIVE_NATS:
        what = f'an input acts {MEANING[hold_now]}, as read: that fits better by {nats:.0f} nats'
    else:
        what = (
            f'whether an input acts {MEANING["next"]} or {MEANING["previous"]} makes no '
            f'difference that shows here ({nats:.0f} nats)'
        )
    return Finding('hold', OK, what)
