# SPDX-License-Identifier: Apache-2.0
"""What is shown now, to be drawn by another process."""

from __future__ import annotations

import numpy as np

from leo_diffmodel.picture.film import RATE
from leo_diffmodel.report.page import source
from leo_diffmodel.watch import curves
from leo_diffmodel.watch.score import told
from leo_diffmodel.watch.state import State
from leo_diffmodel.watch.view import Stage, View

Array = np.ndarray
FILM_SECONDS = 4.0
"""How long a film is."""


def view(state: State, times: Array) -> View:
    """The view at some times on the timeline [s], shape (F,)."""
    scene, frames = state.scene, [state.film.frame(float(t)) for t in times]
    return View(
        title=f'{scene.given.robot.name}: {source(scene.recordings)}',
        error=_error(state),
        switched=_switched(state),
        unit=curves.unit(state),
        seconds=state.horizon,
        stage=Stage(scene.model.robot, scene.recordings),
        times=times,
        places=tuple(scene.timeline.words(float(t)) for t in times),
        poses=np.array([(f.given, f.repaired, f.measured) for f in frames]),
        horizon=curves.against_horizon(state),
        time=curves.over_time(state),
        worst=curves.worst(state),
        held=curves.held(state),
    )


def now(state: State) -> Array:
    """The one time of a picture [s], shape (1,)."""
    return np.array([state.player.now])


def from_now(state: State) -> Array:
    """The times of a film at the speed that is chosen [s]; to the end where less is left."""
    step, count = state.player.speed / RATE, round(FILM_SECONDS * RATE)
    begin = max(0.0, min(state.player.now, state.player.length - step * count))
    times = begin + step * np.arange(count + 1)
    return times[times <= state.player.length]


def _error(state: State) -> str:
    before, after = state.sizes
    return f'{before:.2f} → {after:.2f} noise floors, held out, {told(state.scene).short}'


def _switched(state: State) -> tuple[str, ...]:
    lines = [_line(state, label) for label in state.setting.on]
    if state.setting.refitted and state.answer and (moved := state.answer.data['constants']):
        lines.append(f'refitted by the explanation: {", ".join(moved)}')
    return tuple(lines) or ('nothing is switched on',)


def _line(state: State, label: str) -> str:
    values = state.setting.on[label]
    shown = [
        f'{p.name} = {values[p.name]:.4g} {p.unit}'.rstrip()
        for p in state.scene.candidates[label].parameters
    ]
    return f'{label.replace(":", " at ")}: {", ".join(shown)}'
