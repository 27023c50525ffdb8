# SPDX-License-Identifier: Apache-2.0
"""How far predictions are off, one step and further ahead, beside what noise alone explains."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy.special import ndtri

from leo_diffmodel.bags.recording import Recording
from leo_diffmodel.compare.noise import HISTORY, per_window
from leo_diffmodel.compare.pushes import predict
from leo_diffmodel.compare.sizes import length_unit
from leo_diffmodel.compare.windows import cut, sample_period, Windows
from leo_msgs_py.errors import UserError
from leo_sim.model import Model
from leo_sim.task.task import observation

Array = np.ndarray
HORIZONS = (1, 2, 5, 10, 20, 50, 100, 200, 500)
STATE_STEP = 1e-4
LONGEST_STEP = 1.0
MOST_WINDOWS, MOST_ROLLOUTS = 400, 2000
MOST_SECONDS, DRAWS = 300.0, 6
"""On the ground: simulated time that predictions may take, and starts drawn for the floor."""
NEAR_STEPS, NEAR = 0.75, 0.05
NORMAL = ndtri(0.5 + (np.arange(64) + 0.5) / 128)
"""Sizes of a standard normal variable, each as likely as the others."""
REACHED = 0.5
"""Share of the windows that must be long enough for an error that far ahead."""


@dataclass(frozen=True)
class Prediction:
    """Windows predicted from their measured start, which is noisy: users start there too.

    Attributes:
        windows: the data.
        predicted: states, shape (W, K+1, 2J).
        floor: variance of the error a perfect model would make, shape (W, K+1, 2J).
    """

    windows: Windows
    predicted: Array
    floor: Array

    @property
    def error(self) -> Array:
        """Measured minus predicted, shape (W, K+1, 2J)."""
        return self.windows.measured - self.predicted

    def take(self, index: Array) -> Prediction:
        """Some of the windows."""
        return Prediction(self.windows.take(index), self.predicted[index], self.floor[index])


def predict_windows(model: Model, windows: Windows, sigma: Array) -> Prediction:
    """Predict every window from its measured start, and from starts moved by the noise (R, 2J).

    What a start moved by one standard deviation changes is the floor; moves of that size keep it
    finite where the motion is chaotic. On the ground, where two small moves together may do what
    neither does alone, starts are drawn with the noise instead.
    """
    noise = per_window(sigma, windows)
    start = windows.measured[:, 0]
    moves, count = _moves(model, start.shape)
    starts = np.concatenate([start[None], start + moves * noise[:, 0]])
    y = predict(model, windows, starts)
    floor = ((y[1:] - y[0]) ** 2).sum(axis=0) / count + noise**2
    return Prediction(windows, y[0], floor)


def _moves(model: Model, shape: tuple[int, ...]) -> tuple[Array, int]:
    """Moves of the starts (W, 2J) in noise sigmas, and how often they hold the whole noise."""
    if model.robot.contacts:
        return np.random.default_rng(0).standard_normal((DRAWS, *shape)), DRAWS
    return np.eye(shape[-1])[:, None], 1


def state_names(model: Model) -> list[dict]:
    """Names and units of the states: angles, then rates."""
    units = {j: length_unit(model.robot, j) for j in model.robot.joint_names}
    return [{'name': j, 'unit': unit} for j, unit in units.items()] + [
        {'name': f'{j} rate', 'unit': f'{unit}/s'} for j, unit in units.items()
    ]


def step_seconds(recordings: Sequence[Recording], told: float | None = None) -> float:
    """One step: as told, else one control period.

    That is the median command period, or the sample period where none is known.

    Raises:
        UserError: the step told is shorter than a sample or longer than the windows.
    """
    if told is not None:
        return _checked(told, sample_period(recordings))
    periods = [r.command_period for r in recordings if np.isfinite(r.command_period)]
    return float(np.median(periods)) if periods else sample_period(recordings)


def _checked(step: float, least: float) -> float:
    if not 0.99 * least <= step <= LONGEST_STEP:
        raise UserError(
            f'a step of {step:g} s cannot be scored; give --step from {least:g} s (one sample) '
            f'to {LONGEST_STEP:g} s'
        )
    return step


def has_memory(model: Model) -> bool:
    """Whether predictions need the samples before a window: delay, lag, play, a memory."""
    laws = model.laws
    return bool(laws.dynamic or laws.remembers) or laws.gap is not None


def horizon_windows(
    recordings: Sequence[Recording],
    model: Model,
    seconds: float,
    most: int | None = None,
    remembering: bool = False,
) -> Windows:
    """Overlapping windows of `seconds`, at most `most` of them, evenly spread.

    By default 400, and fewer on robots with many joints, whose floor takes more predictions.

    Windows count samples: where bags differ in rate, those of the fastest last `seconds`. They
    keep what was before them where the model has a memory, or where they shall be `remembering`.
    """
    total = sum(e.t[-1] - e.t[0] for r in recordings for e in r.episodes if len(e.t) > 1)
    period = sample_period(recordings)
    stride = max(period, total / (most or most_windows(model, seconds)))
    seconds *= period / min(sample_period([r]) for r in recordings)
    history = HISTORY if remembering or has_memory(model) else 0.0
    return cut(recordings, seconds, stride=stride, history=history)


def most_windows(model: Model, seconds: float) -> int:
    """How many windows of that length are affordable."""
    if model.robot.contacts:
        return min(MOST_WINDOWS, int(MOST_SECONDS / (seconds * (1 + DRAWS))))
    return min(MOST_WINDOWS, MOST_ROLLOUTS // (1 + 2 * len(model.robot.joint_names)))


def horizon_table(before: Prediction, step: float) -> list[dict]:
    """Errors against horizon: rows {steps, seconds, rmse, mean, noise_floor}."""
    rows = []
    for steps in HORIZONS:
        at = _reached(before, steps * step, step)
        if at is None:
            continue
        rows.append(
            {
                'steps': steps,
                'seconds': at.seconds,
                'rmse': _rms(at.of(before.error)),
                'mean': _mean(_rms(at.of(before.error))),
                'noise_floor': _root_mean(at.of(before.floor)),
            }
        )
    return rows


def joined(near: list[dict], far: list[dict]) -> list[dict]:
    """Rows of the far table, before them those of the near one that it is too coarse for."""
    first = far[0]['steps'] if far else np.inf
    return [row for row in near if row['steps'] < first] + far


def one_step(prediction: Prediction, step: float) -> dict:
    """Mean squared and root mean squared error one control step ahead, with its noise floor."""
    at = _at(prediction, step)
    error, floor = at.of(prediction.error), at.of(prediction.floor)
    return {
        'mse': (error**2).mean(axis=0).tolist(),
        'rmse': _rms(error),
        'mean_mse': float((error**2).mean()),
        'mean_rmse': _mean(_rms(error)),
        'noise_floor': {
            'mse': floor.mean(axis=0).tolist(),
            'rmse': _root_mean(floor),
            'mean_mse': float(floor.mean()),
            'mean_rmse': _mean(_root_mean(floor)),
        },
    }


def observation_mse(model: Model, prediction: Prediction, step: float) -> float:
    """Mean squared one-step error over the robot's observation (thesis Table 7)."""
    at, joints = _at(prediction, step), prediction.windows.q.shape[-1]
    seen, expected = at.of(prediction.windows.measured), at.of(prediction.predicted)
    measured = observation(model.robot, seen[:, :joints], seen[:, joints:])
    predicted = observation(model.robot, expected[:, :joints], expected[:, joints:])
    return float(((measured - predicted) ** 2).mean())


def observation_floor(model: Model, prediction: Prediction, step: float) -> float:
    """Mean squared one-step error over the observation that noise alone causes."""
    at, joints = _at(prediction, step), prediction.windows.q.shape[-1]
    expected, variance = at.of(prediction.predicted), at.of(prediction.floor)
    moves = np.concatenate([np.zeros((1, 2 * joints)), STATE_STEP * np.eye(2 * joints)])
    states = expected + moves[:, None, :]
    seen = observation(model.robot, states[..., :joints], states[..., joints:])
    slope = np.clip((seen[1:] - seen[0]) / STATE_STEP, -1.0, 1.0)  # no quantity is steeper
    return float((slope**2 * np.moveaxis(variance, -1, 0)[..., None]).sum(axis=0).mean())


def errors_ahead(prediction: Prediction, seconds: float) -> Array:
    """Error of each state `seconds` ahead in each window, (W, 2J)."""
    return _at(prediction, seconds).of(prediction.error)


def ahead(prediction: Prediction, seconds: float) -> list[float]:
    """Rms error of each state `seconds` ahead."""
    return _rms(errors_ahead(prediction, seconds))


def change_at_end(prediction: Prediction, other: Array) -> float:
    """How far other predictions (W, K+1, 2J) are from these at the end, in noise floors (rms)."""
    change = (prediction.predicted - other)[:, -1]
    return float(np.sqrt((change**2 / prediction.floor[:, -1]).mean()))


def median_ahead(prediction: Prediction, seconds: float) -> list[float]:
    """Median absolute error of each state `seconds` ahead, which a few hand pushes do not move."""
    return np.median(np.abs(_at(prediction, seconds).of(prediction.error)), axis=0).tolist()


def floor_ahead(prediction: Prediction, seconds: float) -> list[float]:
    """The rms error a perfect model would make of each state `seconds` ahead."""
    return _root_mean(_at(prediction, seconds).of(prediction.floor))


def median_floor_ahead(prediction: Prediction, seconds: float) -> list[float]:
    """The median absolute error a perfect model would make of each state `seconds` ahead."""
    deviation = np.sqrt(_at(prediction, seconds).of(prediction.floor))
    return np.median(NORMAL[:, None, None] * deviation, axis=(0, 1)).tolist()


@dataclass(frozen=True)
class _Instant:
    """The sample of each window nearest to one time ahead; samples may be uneven.

    Attributes:
        windows: windows that reach it, shape (N,).
        sample: the sample there, shape (N,).
        seconds: how far ahead those are, on average [s].
    """

    windows: Array
    sample: Array
    seconds: float

    def of(self, states: Array) -> Array:
        """The states (W, K+1, 2J) at this instant, shape (N, 2J)."""
        return states[self.windows, self.sample]


def _at(prediction: Prediction, seconds: float) -> _Instant:
    """The instant `seconds` ahead, in every window, or as near as the windows get to it."""
    elapsed = np.cumsum(prediction.windows.dt, axis=1)
    nearest = np.argmin(np.abs(elapsed - seconds), axis=1)
    every = np.arange(len(elapsed))
    return _Instant(every, 1 + nearest, float(elapsed[every, nearest].mean()))


def _reached(prediction: Prediction, seconds: float, step: float) -> _Instant | None:
    """The instant in windows that come near it, by a step or a twentieth; None where few do."""
    at = _at(prediction, seconds)
    elapsed = np.cumsum(prediction.windows.dt, axis=1)[at.windows, at.sample - 1]
    near = np.abs(elapsed - seconds) <= max(NEAR_STEPS * step, NEAR * seconds)
    if near.mean() < REACHED:
        return None
    return _Instant(at.windows[near], at.sample[near], float(elapsed[near].mean()))


def _rms(error: Array) -> list[float]:
    return np.sqrt((error**2).mean(axis=0)).tolist()


def _mean(figures: list[float]) -> float:
    return float(np.mean(figures))


def _root_mean(variance: Array) -> list[float]:
    return np.sqrt(variance.mean(axis=0)).tolist()
