# SPDX-License-Identifier: Apache-2.0
"""When does an input act: from its stamp on, or over the period before it? And how late?"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from leo_diffmodel.bags.recording import Recording
from leo_diffmodel.check.finding import ERROR, Finding, OK, WARNING
from leo_diffmodel.check.shift import INTERVALS, misfit, shifted, short
from leo_diffmodel.compare.fineness import stepped
from leo_diffmodel.compare.windows import sample_period
from leo_sim.model import Model

Array = np.ndarray
DECISIVE_NATS = 10.0
SURE = 5.0
TRIFLE = 0.05
LATEST = 0.06
GRID = 0.005
"""s; loss over delay bends slowly enough for that."""
LEAST_LAG = 0.001
OTHER = {'next': 'previous', 'previous': 'next'}
MEANING = {
    'next': 'from its stamp on',
    'previous': 'over the period before its stamp',
}


@dataclass(frozen=True)
class Lag:
    """By how much the input acts after its stamp.

    Attributes:
        seconds: the delay, negative where the input acts before its stamp [s].
        spread: its standard deviation [s].
        removed: share of the misfit beyond noise that the delay removes.
    """

    seconds: float
    spread: float
    removed: float

    @property
    def is_sure(self) -> bool:
        """Whether it stands out of its own uncertainty, and matters."""
        large = abs(self.seconds) > max(SURE * self.spread, LEAST_LAG)
        return large and self.removed > TRIFLE


def hold(
    recording: Recording,
    other: Recording | None,
    hold_now: str,
    late: Lag | None,
    model: Model,
    sigma: Array,
) -> list[Finding]:
    """Which way of holding the inputs the data support, and how late the inputs act.

    Args:
        recording: the bag as read.
        other: the same bag read the other way; None leaves that question out.
        hold_now: 'next' or 'previous', how `recording` was read.
        late: what `lag` found.
        model: the model.
        sigma: noise, shape (2J,).
    """
    found = [] if late is None else [_lag(late, 0.25 * sample_period([recording]))]
    if other is None or recording.input == 'none':
        return found
    ahead = preference(recording, other, model, sigma)
    if ahead < -DECISIVE_NATS and _agrees(late, hold_now):
        return [_wrong_way(hold_now, -ahead)]
    return [_right_way(hold_now, ahead), *found]


def _agrees(late: Lag | None, hold_now: str) -> bool:
    """Whether the delay found, too, says that the bag was read the wrong way."""
    return late is not None and (late.seconds < 0) == (hold_now == 'next')


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


def lag(recording: Recording, model: Model, sigma: Array) -> Lag | None:
    """The delay of the inputs that fits best; None where no input changes enough to tell.

    A grid from one and a half commands (60 ms or more) early to as much late, of 5 ms and then,
    about its best point, of one state period; a parabola through the best point and its
    neighbours gives the rest.
    """
    if recording.input == 'none' or not recording.actuators:
        return None
    step = sample_period([recording])
    reach = max(1.5 * recording.command_period, LATEST)
    model = stepped(model, short(recording, model), sigma[None])
    found = _scanned(lambda n: misfit(shifted(recording, n * step), model, sigma)[1],
                     round(reach / step) + 1, max(1, round(GRID / step)))  # fmt: skip
    excess = _excess(np.min([*found.values()], axis=0), model)
    total = {n: float(loss.sum()) / excess for n, loss in found.items()}
    best = min((n for n in total if {n - 1, n + 1} <= {*total}), key=total.__getitem__)
    left, middle, right = total[best - 1], total[best], total[best + 1]
    bend = left - 2 * middle + right
    if bend < 1.0:
        return None
    offset = float(np.clip(0.5 * (left - right) / bend, -1, 1))
    removed = _removed(found[best], found[0], model)
    return Lag(step * (best + offset), float(step / np.sqrt(bend)), removed)


def _scanned(loss: Callable[[int], Array], reach: int, stride: int) -> dict[int, Array]:
    """Losses at every `stride`-th whole number up to `reach`, and at all about the best one."""
    reach += -reach % stride
    coarse = {n: loss(n) for n in range(-reach, reach + 1, stride)}
    best = min([*coarse][1:-1], key=lambda n: float(coarse[n].sum()))
    near = range(best - stride + 1, best + stride)
    return coarse | {n: loss(n) for n in near if n not in coarse}


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


def _lag(late: Lag, sharp: float) -> Finding:
    seconds, sure = late.seconds, late.is_sure and late.spread < sharp
    size = f'{1e3 * abs(seconds):.1f} ± {2e3 * late.spread:.1f} ms'
    if not sure and late.removed < TRIFLE and abs(seconds) > SURE * late.spread:
        what = 'the model is too far off to tell when an input acts'
        return Finding('lag', OK, what, (), 'check again with the repaired model')
    if not sure:
        told = max(abs(seconds), 2 * late.spread)
        return Finding('lag', OK, f'inputs act at their stamps, to {1e3 * told:.1f} ms')
    if seconds < 0:
        what = f'inputs act {size} before their stamps, which no robot does'
        todo = 'two clocks, or stamps set late: stamp inputs where they are sent'
        return Finding('lag', ERROR, what, (), todo)
    what = f'inputs act {size} after their stamps'
    if seconds > LATEST:
        todo = 'longer than any delay that explain tries: look for a queue or a slow bus'
        return Finding('lag', WARNING, what, (), todo)
    todo = 'nothing: explain tries command_delay, actuator_lag and others that could be the cause'
    return Finding('lag', OK, what, (), todo)
