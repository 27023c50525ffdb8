# SPDX-License-Identifier: Apache-2.0
"""The errors of the state that is shown, as they are drawn."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from leo_diffmodel.watch.state import State

Array = np.ndarray
Columns = dict[str, Array]
DEEPEST = 0.1
"""Of the floor: errors below, as on data without noise, leave the picture."""


def against_horizon(state: State) -> Columns:
    """Rms error on held-out data: seconds, given, now, floor, each (H,)."""
    i = state.shown
    return {
        'seconds': np.array([r['seconds'] for r in state.given.rows]),
        'given': np.array([r['rmse'][i] for r in state.given.rows]),
        'now': np.array([r['rmse'][i] for r in state.now.rows]),
        'floor': np.array([r['noise_floor'][i] for r in state.floor.rows]),
    }


def heights(curves: Mapping[str, Array]) -> tuple[float, float]:
    """The axis of `against_horizon`: all that is no smaller than a part of the floor."""
    values = np.concatenate([curves[name] for name in ('floor', 'given', 'now')])
    least = DEEPEST * float(np.min(curves['floor']))
    return 0.6 * max(float(np.nanmin(values)), least), 1.6 * float(np.nanmax(values))


def over_time(state: State) -> Columns:
    """Rms error of each window of the film: time (its middle), given, now, each (W,)."""
    film, i = state.film, state.shown
    return {
        'time': film.middle,
        'given': film.error(film.given, i),
        'now': film.error(film.repaired, i),
    }


def worst(state: State) -> Columns:
    """The worst windows with the switches as they are: time, begin, error, worst first."""
    film, i = state.film, state.shown
    at = film.worst(i)
    return {
        'time': film.middle[at],
        'begin': film.time[at, 0],
        'error': film.error(film.repaired, i)[at],
    }


def held(state: State) -> Array:
    """Begin and end of each held-out window of the film, (N, 2)."""
    film = state.film
    return film.time[film.held][:, [0, -1]]


def unit(state: State) -> str:
    """The state whose error is shown, with its unit."""
    shown = state.states[state.shown]
    return f'{shown["name"]} [{shown["unit"]}]'
