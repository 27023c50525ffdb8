# SPDX-License-Identifier: Apache-2.0
"""Compare a model with recordings, without fitting anything: the contents of compare.json."""

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field
import time

import numpy as np

from leo_diffmodel.bags.recording import Recording, Recordings
from leo_diffmodel.compare import errors, noise
from leo_diffmodel.compare.known import provenance, with_known
from leo_diffmodel.compare.pushes import fast_enough, stepped
from leo_diffmodel.compare.settings import COMPARE
from leo_diffmodel.compare.torque import missing_torque, MissingTorque
from leo_diffmodel.compare.where import Where, where
from leo_diffmodel.compare.windows import at_one_rate, thin, Windows
from leo_msgs_py.errors import UserError
from leo_sim.model import Model

STAGES = 3


@dataclass(frozen=True)
class Comparison:
    """How wrong a model is on recordings."""

    data: dict
    missing: MissingTorque = field(repr=False)  # the torque the model lacks, window by window
    where: Where = field(repr=False)  # the missing torque by joint and condition
    prediction: errors.Prediction = field(repr=False)
    """The windows behind the errors, as predicted."""


def compare(
    recordings: Recordings,
    model: Model,
    step: float | None = None,
    progress: Callable[[str], None] = lambda _: None,
) -> Comparison:
    """Score a model on recordings of one robot.

    A step [s] is the control period of the data by default. `progress` is called with what comes
    next, `STAGES` times. UserError where the recordings are too short for a single window or say
    constants of themselves that the robot does not have, and of a step out of reach.
    """
    began = time.monotonic()
    model = with_known(model, recordings)
    origin = provenance(recordings, model)
    recordings = at_one_rate(recordings)
    step = errors.step_seconds(recordings, step)
    progress('noise')
    with enough(recordings):
        windows = windows_up_to(COMPARE.horizon_seconds, thin(recordings), model, step)
        one = max(step, float(np.median(windows.dt)))  # a sample, where they are thinned
        ahead = errors.horizon_windows(recordings, model, one)
        model = fast_enough(model, ahead)
        sigma = noise.estimate(model, noise.short_windows(recordings))
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


@contextmanager
def enough(recordings: Recordings, wanted: str = 'at least 2 s') -> Iterator[None]:
    """Say in a UserError of recordings without windows or noise what to record instead."""
    try:
        yield
    except np.linalg.LinAlgError as error:
        worst = max(recordings, key=_fastest)
        raise UserError(
            f'{worst.path}: the model cannot follow rates up to {_fastest(worst):.3g} rad/s; '
            'check units and scale in the topic map'
        ) from error
    except ValueError as error:
        raise UserError(f'{recordings[0].path}: {error}; record {wanted}') from error


def _fastest(recording: Recording) -> float:
    return max(float(np.abs(e.dq).max()) for e in recording.episodes)


def _errors(model: Model, ahead: errors.Prediction, near: errors.Prediction, step: float) -> dict:
    """One step, observation and horizon, each with its noise floor of the same shape."""
    one, seen = errors.one_step(near, step), errors.observation_mse(model, near, step)
    of_one = one.pop('noise_floor')
    far = errors.horizon_table(ahead, step)
    coarse = far[0]['steps'] if far else np.inf
    rows = [r for r in errors.horizon_table(near, step) if r['steps'] < coarse] + far
    floors = [r.pop('noise_floor') for r in rows]
    return {
        'states': errors.state_names(model),
        'step_seconds': step,
        'one_step': one,
        'observation': seen and {'mse': seen[0]},
        'horizon': rows,
        'noise_floor': {
            'one_step': of_one,
            'observation': seen and {'mse': seen[1]},
            'horizon': [
                {**row, 'rmse': floor, 'mean': float(np.mean(floor))}
                for row, floor in zip(rows, floors, strict=True)
            ],
        },
    }


def windows_up_to(seconds: float, recordings: Recordings, model: Model, step: float) -> Windows:
    """Windows of `seconds`, or of half that and so on until a good part of the data holds them.

    ValueError where not even a step fits.
    """
    lengths = np.array([e.seconds for r in recordings for e in r.episodes])
    enough_room = COMPARE.fitting * lengths.sum()
    while seconds > step:
        starts = np.maximum(lengths - (seconds + COMPARE.history), 0.0)
        if starts.sum() > enough_room:
            break
        seconds /= 2
    return errors.horizon_windows(recordings, model, seconds)


def _budget(prediction: errors.Prediction) -> dict:
    """Shares of the measured motion: what the model explains, what it misses, what is noise.

    The motion is the change of the states within half a second. Every state is divided by its own
    mean square, so that angles and rates count alike; one that never moves, as those of a held
    base, does not count. Errors larger than the motion leave nothing explained.
    """
    elapsed = np.cumsum(prediction.windows.dt, axis=1)
    count = 1 + max(1, int((elapsed.mean(axis=0) <= COMPARE.budget_seconds).sum()))
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
    explained = max(0.0, 1.0 - missed - noise_share)
    return {'explained': explained, 'unexplained': missed, 'noise': noise_share}
