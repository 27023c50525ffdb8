# SPDX-License-Identifier: Apache-2.0
"""Several models of one robot on the same recordings, best first, and which are as good.

Errors are shares of the measured motion: the mean square error over the mean square of how far the
states moved, all states of one unit together, then the mean over units. A joint counts as much as
it moves, and angles as much as rates.
"""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from scipy.special import stdtrit

from leo_diffmodel.bags.recording import Recordings
from leo_diffmodel.compare import errors, noise
from leo_diffmodel.compare.blocks import Blocks, make_blocks
from leo_diffmodel.compare.comparison import enough, windows_up_to
from leo_diffmodel.compare.known import provenance, with_known
from leo_diffmodel.compare.pushes import stepped
from leo_diffmodel.compare.settings import COMPARE
from leo_diffmodel.compare.windows import Array, at_one_rate, thin, Windows
from leo_msgs_py.errors import UserError
from leo_sim.model import Model

STAGES = 2


@dataclass(frozen=True)
class _Scored:
    square: Array  # squared errors of each window and state, (W, S)
    floor: Array  # what noise alone makes of them, (W, S)
    share: Array  # mean squared errors as shares of the motion, (W,)
    noise: float  # what noise alone makes of that share


def rank(
    recordings: Recordings,
    models: Mapping[str, Model],
    step: float | None = None,
    progress: Callable[[str], None] = lambda _: None,
) -> dict:
    """Score models half a second ahead on the same windows: the contents of ranking.json.

    Nothing is fitted, so all data are held out; where a model was fitted to one of these bags,
    blocks of time that no fit saw (`Blocks.held`). The difference of each model to the best is
    averaged in each block of 2 s (an eighth of a shorter bag); where its 95 % t interval over the
    blocks holds 0, the two are not distinguishable. `step` [s] is the shortest window, by default
    the control period of the data; `progress` is called `STAGES` times for each model. UserError
    of models of different robots and recordings too short, and as `compare`.
    """
    _same_robot(models)
    origin = {name: provenance(recordings, model) for name, model in models.items()}
    entries = (entry for model in models.values() for entry in model.history)
    learned = {bag.get('sha256') for entry in entries for bag in entry.get('bags', ())}
    fitted = any(recording.sha256 in learned for recording in recordings)
    models = {name: with_known(model, recordings) for name, model in models.items()}
    recordings = at_one_rate(recordings)
    blocks, states = make_blocks(recordings, []), errors.state_names(models[next(iter(models))])
    windows, sigma = half_seconds(recordings, models, step, progress)
    windows = _held(windows, blocks, recordings) if fitted else windows
    scored = {}
    for name, model in models.items():
        progress(f'predictions of {name}')
        scored[name] = _score(model, windows, sigma, [state['unit'] for state in states])
    number = blocks.index(windows)
    return {
        'states': states,
        'seconds': float(windows.dt.sum(axis=1).mean()),
        'windows': windows.count,
        'blocks': len(np.unique(number)),
        'held_out_blocks_only': fitted,
        'models': _rows(scored, number),
        'provenance': origin,
    }


def _same_robot(models: Mapping[str, Model]) -> None:
    first, known = next(iter(models.items()))
    wanted = known.robot.joint_names, known.robot.input
    for name, model in models.items():
        if (model.robot.joint_names, model.robot.input) != wanted:
            raise UserError(
                f'{name} is of the robot {model.robot.name} and {first} of {known.robot.name}; '
                'models that are compared have the same joints and input'
            )


def half_seconds(
    recordings: Recordings,
    models: Mapping[str, Model],
    step: float | None,
    progress: Callable[[str], None],
) -> tuple[Windows, Array]:
    """Windows of half a second, with the past that any model needs, and the noise (R, 2J).

    The noise is the least that any model leaves. UserError where the data are too short for a
    single window, or no model can follow the rates.
    """
    needy, found = max(models.values(), key=errors.has_memory), []
    with enough(recordings):
        shortest = errors.step_seconds(recordings, step)
        windows = windows_up_to(COMPARE.budget_seconds, thin(recordings), needy, shortest)
        for name, model in models.items():
            progress(f'noise with {name}')
            found.append(noise.estimate(model, noise.short_windows(recordings)))
    return windows, np.min(found, axis=0)


def _held(windows: Windows, blocks: Blocks, recordings: Recordings) -> Windows:
    held = blocks.held(windows)
    if not held.any():
        raise UserError(
            f'{recordings[0].path}: a model was fitted to it, and it is too short to hold out a '
            'part; compare on another bag'
        )
    return windows.take(held)


def _score(model: Model, windows: Windows, sigma: Array, units: Sequence[str]) -> _Scored:
    prediction = errors.predict_windows(stepped(model, windows, sigma), windows, sigma)
    square, floor = prediction.error[:, -1] ** 2, prediction.floor[:, -1]
    motion = (windows.measured[:, -1] - windows.measured[:, 0]) ** 2
    share, beneath = np.zeros(windows.count), 0.0
    for unit in dict.fromkeys(units):
        of_unit = np.array([u == unit for u in units])
        moved = max(motion[:, of_unit].mean(), COMPARE.stillest**2)
        share += square[:, of_unit].mean(axis=1) / moved
        beneath += float(floor[:, of_unit].mean() / moved)
    kinds = len(set(units))
    return _Scored(square, floor, share / kinds, beneath / kinds)


def _rows(scored: Mapping[str, _Scored], block: Array) -> list[dict]:
    ordered = sorted(scored.items(), key=lambda pair: pair[1].share.mean())
    best = ordered[0][1].share
    return [
        {
            'model': name,
            'share': float(model.share.mean()),
            'noise_share': model.noise,
            'rmse': errors.root_mean(model.square),
            'noise_floor': errors.root_mean(model.floor),
            'behind': behind(model.share - best, block),
        }
        for name, model in ordered
    ]


def behind(difference: Array, block: Array) -> dict:
    """How far a model is behind the best, by the difference of their shares in each window (W,).

    With its 95 % interval over the blocks of the windows (W,), None where there is one block.
    """
    means = np.array([difference[block == b].mean() for b in np.unique(block)])
    value, count = float(means.mean()), len(means)
    if count < 2:
        return {'value': value, 'ci95': None, 'distinguishable': False}
    half = float(stdtrit(count - 1, COMPARE.sure) * means.std(ddof=1) / np.sqrt(count))
    return {'value': value, 'ci95': [value - half, value + half], 'distinguishable': value > half}
