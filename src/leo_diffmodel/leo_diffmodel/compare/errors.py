# SPDX-License-Identifier: Apache-2.0
"""How far predictions are off, one step and further ahead, beside what noise alone explains."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from leo_diffmodel.bags.recording import Recording
from leo_diffmodel.compare.noise import HISTORY, per_window
from leo_diffmodel.compare.windows import cut, sample_period, Windows
from leo_msgs_py.errors import UserError
from leo_sim.batch import rollout
from leo_sim.model import Model
from leo_sim.task import observation

Array = np.ndarray
HORIZONS = (1, 2, 5, 10, 20, 50, 100, 200, 500)
STATE_STEP = 1e-4
LONGEST_STEP = 1.0


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


def predict_windows(model: Model, windows: Windows, sigma: Array) -> Prediction:
    """Predict every window from its measured start and propagate the noise (R, 2J) through it."""
    joints = windows.q.shape[-1]
    start = windows.measured[:, 0]
    moves = np.concatenate([np.zeros((1, 2 * joints)), STATE_STEP * np.eye(2 * joints)])
    starts = start + moves[:, None, :]
    q, dq = rollout(
        model,
        starts[..., :joints],
        starts[..., joints:],
        windows.inputs,
        windows.dt,
        enabled=windows.enabled,
        history=windows.history,
    )
    y = np.concatenate([q, dq], axis=-1)
    slope = (y[1:] - y[0]) / STATE_STEP
    noise = per_window(sigma, windows)
    floor = (slope**2 * np.moveaxis(noise, -1, 0)[..., None] ** 2).sum(axis=0) + noise**2
    return Prediction(windows, y[0], floor)


def state_names(model: Model) -> list[dict]:
    """Names and units of the states: angles, then rates."""
    joints = model.robot.joint_names
    return [{'name': j, 'unit': 'rad'} for j in joints] + [
        {'name': f'{j} rate', 'unit': 'rad/s'} for j in joints
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
    """Whether predictions need the samples before a window: delay, lag or play."""
    return bool(model.laws.dynamic) or model.laws.gap is not None


def horizon_windows(
    recordings: Sequence[Recording], model: Model, seconds: float, most: int = 400
) -> Windows:
    """Overlapping windows of `seconds`, at most `most` of them, evenly spread."""
    total = sum(e.t[-1] - e.t[0] for r in recordings for e in r.episodes if len(e.t) > 1)
    stride = max(sample_period(recordings), total / most)
    history = HISTORY if has_memory(model) else 0.0
    return cut(recordings, seconds, stride=stride, history=history)


def horizon_table(before: Prediction, step: float) -> list[dict]:
    """Errors against horizon: rows {steps, seconds, rmse, mean, noise_floor}."""
    rows = []
    elapsed = np.cumsum(before.windows.dt, axis=1).mean(axis=0)
    for steps in HORIZONS:
        at = int(np.argmin(np.abs(elapsed - steps * step)))
        if abs(elapsed[at] - steps * step) > 0.5 * step:
            continue
        rows.append(
            {
                'steps': steps,
                'seconds': float(elapsed[at]),
                'rmse': _rms(before.error[:, at + 1]),
                'mean': _mean(_rms(before.error[:, at + 1])),
                'noise_floor': _root_mean(before.floor[:, at + 1]),
            }
        )
    return rows


def one_step(prediction: Prediction, step: float) -> dict:
    """Mean squared and root mean squared error one control step ahead, with its noise floor."""
    at = _index(prediction, step)
    error, floor = prediction.error[:, at], prediction.floor[:, at]
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
    at, joints = _index(prediction, step), prediction.windows.q.shape[-1]
    seen, expected = prediction.windows.measured[:, at], prediction.predicted[:, at]
    measured = observation(model.robot, seen[:, :joints], seen[:, joints:])
    predicted = observation(model.robot, expected[:, :joints], expected[:, joints:])
    return float(((measured - predicted) ** 2).mean())


def observation_floor(model: Model, prediction: Prediction, step: float) -> float:
    """Mean squared one-step error over the observation that noise alone causes."""
    at, joints = _index(prediction, step), prediction.windows.q.shape[-1]
    expected, variance = prediction.predicted[:, at], prediction.floor[:, at]
    moves = np.concatenate([np.zeros((1, 2 * joints)), STATE_STEP * np.eye(2 * joints)])
    states = expected + moves[:, None, :]
    seen = observation(model.robot, states[..., :joints], states[..., joints:])
    slope = np.clip((seen[1:] - seen[0]) / STATE_STEP, -1.0, 1.0)  # no quantity is steeper
    return float((slope**2 * np.moveaxis(variance, -1, 0)[..., None]).sum(axis=0).mean())


def ahead(prediction: Prediction, seconds: float) -> list[float]:
    """Rms error of each state `seconds` ahead."""
    return _rms(prediction.error[:, _index(prediction, seconds)])


def median_ahead(prediction: Prediction, seconds: float) -> list[float]:
    """Median absolute error of each state `seconds` ahead, which a few hand pushes do not move."""
    return np.median(np.abs(prediction.error[:, _index(prediction, seconds)]), axis=0).tolist()


def floor_ahead(prediction: Prediction, seconds: float) -> list[float]:
    """The rms error a perfect model would make of each state `seconds` ahead."""
    return _root_mean(prediction.floor[:, _index(prediction, seconds)])


def _index(prediction: Prediction, step: float) -> int:
    elapsed = np.cumsum(prediction.windows.dt, axis=1).mean(axis=0)
    return 1 + int(np.argmin(np.abs(elapsed - step)))


def _rms(error: Array) -> list[float]:
    return np.sqrt((error**2).mean(axis=0)).tolist()


def _mean(figures: list[float]) -> float:
    return float(np.mean(figures))


def _root_mean(variance: Array) -> list[float]:
    return np.sqrt(variance.mean(axis=0)).tolist()
