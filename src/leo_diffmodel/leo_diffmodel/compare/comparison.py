# SPDX-License-Identifier: Apache-2.0
"""Compare a model with recordings, without fitting anything: the contents of compare.json."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
import time

import numpy as np

from leo_diffmodel.bags.recording import Recording
from leo_diffmodel.compare import errors, noise
from leo_diffmodel.compare.known import with_known
from leo_diffmodel.compare.provenance import provenance
from leo_diffmodel.compare.scheme import fast_enough, stepped
from leo_diffmodel.compare.thin import periods, thin
from leo_diffmodel.compare.torque import missing_torque, MissingTorque
from leo_diffmodel.compare.where import Where, where
from leo_diffmodel.compare.windows import Windows
from leo_msgs_py.errors import UserError
from leo_sim.model import Model

HORIZON_SECONDS = 2.0
BUDGET_SECONDS = 0.5
RATES_APART = 1.5
STAGES = 3
FITTING = 0.2
Array = np.ndarray


@dataclass(frozen=True)
class Comparison:
    """How wrong a model is on recordings.

    Attributes:
        data: the contents of compare.json.
        missing: the torque the model lacks, window by window.
        where: the missing torque by joint and condition.
        prediction: the windows behind the errors, as predicted.
    """

    data: dict
    missing: MissingTorque = field(repr=False)
    where: Where = field(repr=False)
    prediction: errors.Prediction = field(repr=False)


def compare(
    recordings: Sequence[Recording],
    model: Model,
    step: float | None = None,
    progress: Callable[[str], None] = lambda _: None,
) -> Comparison:
    """Score a model on recordings.

    Args:
        recordings: bags of one robot.
        model: the model.
        step: length of one step [s]; by default the control period of the data.
        progress: told what comes next; `STAGES` times.

    Raises:
        UserError: the recordings are too short for a single window, or a step out of reach; or
            they say constants of themselves that the robot does not have.
    """
    began = time.monotonic()
    model = with_known(model, recordings)
    origin = provenance(recordings, model)
    recordings = at_one_rate(recordings)
    step = errors.step_seconds(recordings, step)
    progress('noise')
    try:
        windows = windows_up_to(HORIZON_SECONDS, thin(recordings), model, step)
        ahead = errors.horizon_windows(recordings, model, _near(windows, step))
        model = fast_enough(model, ahead)
        sigma = noise.estimate(model, noise.short_windows(recordings))
    except np.linalg.LinAlgError as error:
        raise UserError(beyond(recordings)) from error
    except ValueError as error:
        raise UserError(f'{recordings[0].path}: {error}; record at least 2 s') from error
    progress('predictions')
    prediction = errors.predict_windows(stepped(model, windows, sigma), windows, sigma)
    near = errors.predict_windows(model, ahead, sigma)
    progress('missing torque')
    missing = missing_torque(recordings, model, sigma)
    places = where(missing, model)
    data = _errors(model, prediction, near, step) | {
        'noise': sigma.tolist(),
        'joints': places.joints,
        'where': places.rows,
        'noise_only': places.noise_only,
        'untrusted': missing.untrusted,
        'scheme': model.scheme,
        'events': places.events,
        'budget': _budget(prediction),
        'seconds': time.monotonic() - began,
        'provenance': origin,
    }
    return Comparison(data, missing, places, prediction)


def beyond(recordings: Sequence[Recording]) -> str:
    """What to say where the model cannot follow what a recording holds."""
    worst = max(recordings, key=_fastest)
    return (
        f'{worst.path}: the model cannot follow rates up to {_fastest(worst):.3g} rad/s; '
        'check units and scale in the topic map'
    )


def _fastest(recording: Recording) -> float:
    return max(float(np.abs(e.dq).max()) for e in recording.episodes)


def _errors(
    model: Model, prediction: errors.Prediction, near: errors.Prediction, step: float
) -> dict:
    """One step, observation and horizon, each with its noise floor of the same shape."""
    one = errors.one_step(near, step)
    floor = one.pop('noise_floor')
    horizon = errors.joined(
        errors.horizon_table(near, step), errors.horizon_table(prediction, step)
    )
    return {
        'states': errors.state_names(model),
        'step_seconds': step,
        'one_step': one,
        'observation': _observation(model, near, step),
        'horizon': [{k: r[k] for k in ('steps', 'seconds', 'rmse', 'mean')} for r in horizon],
        'noise_floor': {
            'one_step': floor,
            'observation': _observation_floor(model, near, step),
            'horizon': [_floor_row(r) for r in horizon],
        },
    }


def at_one_rate(recordings: Sequence[Recording]) -> Sequence[Recording]:
    """As they are, or thinned where one is sampled half as often again as another."""
    steps = periods(recordings) or [0.0]
    return thin(recordings) if max(steps) > RATES_APART * min(steps) else recordings


def windows_up_to(
    seconds: float, recordings: Sequence[Recording], model: Model, step: float
) -> Windows:
    """Windows of so many seconds, or as long as fits a good part of the data.

    Raises:
        ValueError: not even a step fits.
    """
    lengths = np.array([float(e.t[-1] - e.t[0]) for r in recordings for e in r.episodes])
    while seconds > step and not _fits(lengths, seconds + noise.HISTORY):
        seconds /= 2
    return errors.horizon_windows(recordings, model, seconds)


def _near(windows: Windows, step: float) -> float:
    """One step, or one sample of the long windows where those are thinned to longer ones [s]."""
    return max(step, float(np.median(windows.dt)))


def _fits(lengths: Array, seconds: float) -> bool:
    """Whether windows of that length can start in a good part of the data."""
    return bool(np.maximum(lengths - seconds, 0.0).sum() > FITTING * lengths.sum())


def _observation(model: Model, prediction: errors.Prediction, step: float) -> dict | None:
    if not model.robot.observation:
        return None
    return {'mse': errors.observation_mse(model, prediction, step)}


def _observation_floor(model: Model, prediction: errors.Prediction, step: float) -> dict | None:
    if not model.robot.observation:
        return None
    return {'mse': errors.observation_floor(model, prediction, step)}


def _floor_row(row: dict) -> dict:
    floor = row['noise_floor']
    return {
        'steps': row['steps'],
        'seconds': row['seconds'],
        'rmse': floor,
        'mean': float(np.mean(floor)),
    }


def _budget(prediction: errors.Prediction) -> dict:
    """Shares of the measured motion: what the model explains, what it misses, what is noise.

    The motion is the change of the states within half a second; every state is weighed by its
    own mean square, so that angles and rates count alike; one that never moves, as those of a
    held base, counts for nothing. Errors larger than the motion leave nothing explained.
    """
    elapsed = np.cumsum(prediction.windows.dt, axis=1)
    count = 1 + max(1, int((elapsed.mean(axis=0) <= BUDGET_SECONDS).sum()))
    measured = prediction.windows.measured[:, :count]
    motion = ((measured - measured[:, :1]) ** 2).mean(axis=(0, 1))
    error = (prediction.error[:, :count] ** 2).mean(axis=(0, 1))
    floor = np.minimum(prediction.floor[:, :count].mean(axis=(0, 1)), error)
    whole = np.maximum(motion, error)
    moved = whole > 0
    if not moved.any():
        return {'explained': 1.0, 'unexplained': 0.0, 'noise': 0.0}
    noise_share = float((floor[moved] / whole[moved]).mean())
    missed = float(((error - floor)[moved] / whole[moved]).mean())
    return {
        'explained': max(0.0, 1.0 - missed - noise_share),
        'unexplained': missed,
        'noise': noise_share,
    }
