# SPDX-License-Identifier: Apache-2.0
"""The error of an exported model on recordings beside that of the model it was made of.

All predict the same windows of half a second from their measured starts: the model; the model
less what the format does not hold; and where MuJoCo reads the format, MuJoCo with the file.
"""

from collections.abc import Callable
import math
from typing import Any

import numpy as np

from leo_diffmodel.bags.recording import Recordings
from leo_diffmodel.compare import errors
from leo_diffmodel.compare.headline import Figures, Headline, headline
from leo_diffmodel.compare.known import with_known
from leo_diffmodel.compare.pushes import predict
from leo_diffmodel.compare.ranking import half_seconds
from leo_diffmodel.compare.windows import at_one_rate, Windows
from leo_sim.model import Model
from leo_sim.references import load_mujoco

STAGES = 3
OURS, REDUCED, EXPORTED = 'ours', 'reduced', 'exported'


def check(
    recordings: Recordings,
    model: Model,
    reduced: Model,
    mjcf: str | None = None,
    progress: Callable[[str], None] = lambda _: None,
) -> dict[str, Any]:
    """Errors of a model, of what a format holds of it, and of an exported MJCF in MuJoCo.

    `reduced` is the model less what the format does not hold; `mjcf` the text of the exported
    file, None for formats that MuJoCo does not read. `progress` is called `STAGES` times.

    Returns:
        seconds, statistic, windows, states [{name, unit}]; of each predictor and of the noise
        floor its error in each state (`errors`) and over the states of each unit (`by_unit`), None
        for one without end.

    UserError: recordings too short, or rates that no model can follow; no MuJoCo here.
    """
    played: Any = None
    if mjcf is not None:
        robot, motors = model.robot, [a.joint for a in model.robot.actuators]
        joints, of_base = robot.joint_names, len(robot.base_joints)
        played = needs_mujoco().Played(mjcf, joints, motors, of_base)
    model = with_known(model, recordings)
    recordings = at_one_rate(recordings)
    windows, sigma = half_seconds(recordings, {model.robot.name: model}, None, progress)
    progress('predictions')
    ours = errors.predict_windows(model, windows, sigma)
    others = {REDUCED: predict(reduced, windows, windows.measured[:, 0])}
    progress('MuJoCo' if played else 'errors')
    if played is not None:
        others[EXPORTED] = _in_mujoco(played, windows)
    found = {OURS: ours} | {
        name: errors.Prediction(windows, states, ours.floor) for name, states in others.items()
    }
    head = headline(model.robot, float(np.median(windows.dt.sum(axis=1))))
    figures = {name: head.figures(p) for name, p in found.items()}
    return _report(model, windows, head, figures | {'noise_floor': head.floor(ours)})


def needs_mujoco() -> Any:
    """What plays an exported MJCF; UserError: how to install it."""
    return load_mujoco('--check of an MJCF')


def _report(
    model: Model, windows: Windows, head: Headline, figures: dict[str, Figures]
) -> dict[str, Any]:
    states = errors.state_names(model)
    units = [state['unit'] for state in states]
    return {
        'seconds': head.seconds,
        'statistic': head.statistic,
        'windows': windows.count,
        'states': states,
        'errors': {n: [_finite(x) for x in f[head.statistic]] for n, f in figures.items()},
        'by_unit': {
            name: {unit: _finite(x) for unit, x in head.by_unit(f, units).items()}
            for name, f in figures.items()
        },
    }


def _finite(error: float) -> float | None:
    """None for an error without end: a joint that has lost all of its inertia."""
    return error if math.isfinite(error) else None


def _in_mujoco(played: Any, windows: Windows) -> np.ndarray:
    """What the file does in each window, (W, K + 1, 2 J)."""
    from leo_sim.references.mujoco import Steps

    states = []
    for i in range(windows.count):
        steps = Steps(windows.inputs[i], windows.enabled[i], windows.dt[i])
        past = windows.history and Steps(*(part[i] for part in windows.history[2:]))
        start, held = windows.measured[i, 0], bool(windows.held[i])
        states.append(played.window(start, steps, past, held))
    return np.stack(states)
