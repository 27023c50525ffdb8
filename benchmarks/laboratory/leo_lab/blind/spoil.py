# SPDX-License-Identifier: Apache-2.0
"""A clean log as it would be with a fault, which `leo_diffmodel.faults` has to find."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np

from leo_diffmodel.bags.episode import Episode
from leo_diffmodel.bags.mend import with_inputs_late
from leo_diffmodel.faults.catalogue import FAULTS

Array = np.ndarray
COLUMNS = {'angle': 'q', 'speed': 'dq', 'input': 'inputs'}  # of an episode, by channel


def spoil(name: str, e: Episode, j: int, a: int, value: float) -> Episode:
    """The episode with a fault of size `value` at joint j, whose actuator is a."""
    if name in OF_EPISODES:
        return OF_EPISODES[name](e, j, a, value)
    channel = FAULTS[name].channel
    column, k = COLUMNS[channel], a if channel == 'input' else j
    values = getattr(e, column).copy()
    values[:, k] = logged(name, e.t, values[:, k], value)
    return replace(e, **{column: values})


def logged(name: str, t: Array, x: Array, value: float) -> Array:
    """What a log with a fault has of its channel x (T,) at times t (T,) [s]: else a multiple."""
    return OF_CHANNELS[name](t, x, value) if name in OF_CHANNELS else value * x


def filtered(t: Array, x: Array, tau: float) -> Array:
    """Values (T,) behind a first-order filter, exact for straight lines between samples."""
    out = x.copy()
    y = float(x[0])
    for k, h in enumerate(np.diff(t)):
        x0, slope = float(x[k]), float(x[k + 1] - x[k]) / h
        steady = x0 - slope * tau
        y = steady + slope * h + (y - steady) * np.exp(-h / tau)
        out[k + 1] = y
    return out


OF_CHANNELS: dict[str, Callable[[Array, Array, float], Array]] = {
    'angle_zero': lambda t, x, value: x + value,
    'quantised': lambda t, x, value: value * np.round(x / value),
    'speed_zero': lambda t, x, value: x + value,
    'speed_late': lambda t, x, value: np.interp(t - value, t, x),
    'speed_filter': filtered,
    'clipped': lambda t, x, value: np.clip(x, -value, value),
    'speed_wraps': lambda t, x, value: np.where(x < 0, x + value, x),
    'speed_sign_bit': lambda t, x, value: np.where(x < 0, value - x, x),
}


def _goal_as_angle(e: Episode, j: int, a: int, value: float) -> Episode:
    q = e.q.copy()
    q[:, j] = e.inputs[:, a]
    return replace(e, q=q)


def _goal_exchanged(e: Episode, j: int, a: int, value: float) -> Episode:
    q, inputs = e.q.copy(), e.inputs.copy()
    q[:, j], inputs[:, a] = e.inputs[:, a], e.q[:, j]
    return replace(e, q=q, inputs=inputs)


def _frozen(e: Episode, j: int, a: int, value: float) -> Episode:
    before = e.t <= e.t[-1] - value
    fastest = int(np.argmax(np.abs(e.dq[:, j]) * before))
    stuck = (e.t >= e.t[fastest]) & (e.t < e.t[fastest] + value)
    q = e.q.copy()
    q[stuck, j] = q[fastest, j]
    return replace(e, q=q)


def _repeated(e: Episode, j: int, a: int, value: float) -> Episode:
    again = np.random.default_rng(0).uniform(size=len(e.t)) < value
    again[0] = False
    fresh = np.maximum.accumulate(np.where(again, 0, np.arange(len(e.t))))
    return replace(e, q=e.q[fresh], dq=e.dq[fresh])


def _input_exchanged(e: Episode, j: int, a: int, value: float) -> Episode:
    return replace(e, inputs=np.roll(e.inputs, 1, axis=1))


def _input_dead(e: Episode, j: int, a: int, value: float) -> Episode:
    u = e.inputs.copy()
    u[: int(value * len(u)), a] = 0.0
    return replace(e, inputs=u)


def _input_late(e: Episode, j: int, a: int, value: float) -> Episode:
    return with_inputs_late(e, [-value] * e.inputs.shape[1])


def _time_stretch(e: Episode, j: int, a: int, value: float) -> Episode:
    return replace(e, t=e.t * value)


OF_EPISODES: dict[str, Callable[[Episode, int, int, float], Episode]] = {
    'goal_as_angle': _goal_as_angle,
    'goal_exchanged': _goal_exchanged,
    'frozen': _frozen,
    'repeated': _repeated,
    'input_exchanged': _input_exchanged,
    'input_dead': _input_dead,
    'input_late': _input_late,
    'time_stretch': _time_stretch,
}
