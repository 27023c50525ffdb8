# SPDX-License-Identifier: Apache-2.0
"""How far predictions are off, one step and further ahead, and what noise alone explains."""

from dataclasses import dataclass

import numpy as np

from leo_diffmodel.bags.episode import sample_period
from leo_diffmodel.bags.recording import Recordings
from leo_diffmodel.compare.noise import of_inputs
from leo_diffmodel.compare.pushes import predict
from leo_diffmodel.compare.settings import COMPARE
from leo_diffmodel.compare.sizes import length_unit
from leo_diffmodel.compare.windows import Array, cut, per_window, Windows
from leo_msgs_py.errors import UserError
from leo_sim.model import Model
from leo_sim.task.task import observation


@dataclass(frozen=True)
class Prediction:
    """Windows predicted from their measured start, noisy as it is, as a user predicts them."""

    windows: Windows
    predicted: Array  # states, shape (W, K+1, 2J)
    floor: Array  # variance of the error a perfect model would make, shape (W, K+1, 2J)

    @property
    def error(self) -> Array:
        """Measured minus predicted, shape (W, K+1, 2J)."""
        return self.windows.measured - self.predicted

    def ahead(self, seconds: float) -> tuple[Array, Array]:
        """Error `seconds` ahead in each window, and the variance of its floor, (W, 2J) each."""
        at = _at(self, seconds)
        return at.of(self.error), at.of(self.floor)

    def take(self, index: Array) -> 'Prediction':
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
    y = predict(model, windows, np.concatenate([start[None], start + moves * noise[:, 0]]))
    floor = ((y[1:] - y[0]) ** 2).sum(axis=0) / count + noise**2
    drift = of_inputs(model, windows)
    if drift is not None:
        floor = floor + per_window(drift, windows) ** 2
    return Prediction(windows, y[0], floor)


def _moves(model: Model, shape: tuple[int, ...]) -> tuple[Array, int]:
    """Moves of the starts (W, 2J) in noise sigmas, and how many times they add up to the noise."""
    if model.robot.contacts:
        draws = COMPARE.draws
        return np.random.default_rng(0).standard_normal((draws, *shape)), draws
    return np.eye(shape[-1])[:, None], 1


def state_names(model: Model) -> list[dict]:
    """Names and units of the states: angles, then rates."""
    units = {j: length_unit(model.robot, j) for j in model.robot.joint_names}
    return [{'name': j, 'unit': unit} for j, unit in units.items()] + [
        {'name': f'{j} rate', 'unit': f'{unit}/s'} for j, unit in units.items()
    ]


def step_seconds(recordings: Recordings, step: float | None = None) -> float:
    """One step [s]: as given, else the median command period, or the sample period without one.

    UserError where the given step is shorter than a sample or longer than the windows.
    """
    if step is not None:
        least, most = sample_period(recordings), COMPARE.longest_step
        if not 0.99 * least <= step <= most:
            raise UserError(
                f'a step of {step:g} s cannot be scored; give --step from {least:g} s (one '
                f'sample) to {most:g} s'
            )
        return step
    periods = [r.command_period for r in recordings if np.isfinite(r.command_period)]
    return float(np.median(periods)) if periods else sample_period(recordings)


def has_memory(model: Model) -> bool:
    """Whether predictions need the samples before a window: delay, lag, backlash, a memory."""
    laws = model.laws
    return bool(laws.dynamic or laws.remembers) or laws.gap is not None


def horizon_windows(
    recordings: Recordings,
    model: Model,
    seconds: float,
    most: int | None = None,
    remembering: bool = False,
) -> Windows:
    """Overlapping windows of `seconds`, at most `most` (`most_windows`), evenly spread.

    Windows count samples: where bags differ in rate, those of the fastest last `seconds`. They
    keep what was before them where the model has a memory, or where `remembering` says so.
    """
    total = sum(e.seconds for r in recordings for e in r.episodes if len(e.t) > 1)
    period = sample_period(recordings)
    stride = max(period, total / (most or most_windows(model, seconds)))
    seconds *= period / min(r.state_period for r in recordings)
    history = COMPARE.history if remembering or has_memory(model) else 0.0
    return cut(recordings, seconds, stride=stride, history=history)


def most_windows(model: Model, seconds: float) -> int:
    """How many windows of that length are affordable."""
    most = COMPARE.most_rollouts // (1 + 2 * len(model.robot.joint_names))
    if model.robot.contacts:
        most = int(COMPARE.most_seconds / (seconds * (1 + COMPARE.draws)))
    return min(COMPARE.most_windows, most)


def horizon_table(before: Prediction, step: float) -> list[dict]:
    """Errors against horizon: rows {steps, seconds, rmse, mean, noise_floor}."""
    rows = []
    for steps in COMPARE.horizons:
        at = _reached(before, steps * step, step)
        if at is None:
            continue
        rmse, floor = (root_mean(x) for x in (at.of(before.error) ** 2, at.of(before.floor)))
        row = {'steps': steps, 'seconds': at.seconds, 'rmse': rmse, 'mean': float(np.mean(rmse))}
        rows.append(row | {'noise_floor': floor})
    return rows


def one_step(prediction: Prediction, step: float) -> dict:
    """Mean squared and root mean squared error one control step ahead, with its noise floor."""
    error, floor = prediction.ahead(step)
    return {**_of_square(error**2), 'noise_floor': _of_square(floor)}


def _of_square(square: Array) -> dict:
    return {
        'mse': square.mean(axis=0).tolist(),
        'rmse': root_mean(square),
        'mean_mse': float(square.mean()),
        'mean_rmse': float(np.mean(root_mean(square))),
    }


def observation_mse(model: Model, made: Prediction, step: float) -> tuple[float, float] | None:
    """Mean squared one-step error over the observation of a robot (thesis Table 7), and its floor.

    None for a robot without an observation.
    """
    if not model.robot.observation:
        return None
    at, joints = _at(made, step), made.windows.q.shape[-1]

    def seen(states: Array) -> Array:
        return observation(model.robot, states[..., :joints], states[..., joints:])

    expected = at.of(made.predicted)
    moves = np.concatenate([np.zeros((1, 2 * joints)), COMPARE.state_step * np.eye(2 * joints)])
    moved = seen(expected + moves[:, None, :])
    slope = np.clip((moved[1:] - moved[0]) / COMPARE.state_step, -1.0, 1.0)  # none is steeper
    variance = np.moveaxis(at.of(made.floor), -1, 0)[..., None]
    return (
        float(((seen(at.of(made.windows.measured)) - seen(expected)) ** 2).mean()),
        float((slope**2 * variance).sum(axis=0).mean()),
    )


def change_at_end(prediction: Prediction, other: Array) -> float:
    """How far other predictions (W, K+1, 2J) are from these at the end, in noise floors.

    Root mean square over windows, angle and rate of the joint where that is most.
    """
    change = (prediction.predicted - other)[:, -1]
    square = (change**2 / prediction.floor[:, -1]).mean(axis=0)
    return float(np.sqrt(square.reshape(2, -1).mean(axis=0).max()))


@dataclass(frozen=True)
class _Instant:
    """The sample of each window nearest to one time ahead; samples may be uneven."""

    windows: Array  # windows that reach it, shape (N,)
    sample: Array  # the sample there, shape (N,)
    seconds: float  # how far ahead those are, on average [s]

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
    near = np.abs(elapsed - seconds) <= max(COMPARE.near_steps * step, COMPARE.near * seconds)
    if near.mean() < COMPARE.reached:
        return None
    return _Instant(at.windows[near], at.sample[near], float(elapsed[near].mean()))


def root_mean(square: Array) -> list[float]:
    """Root of the mean over windows (W, 2J) of each state."""
    return np.sqrt(square.mean(axis=0)).tolist()
