# SPDX-License-Identifier: Apache-2.0
"""What the page shows as plain values: curves, where poses are drawn, a view to be drawn apart."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from leo_diffmodel.bags.recording import Recording
from leo_diffmodel.compare.windows import Array
from leo_diffmodel.picture import palette
from leo_diffmodel.picture.film import RATE
from leo_diffmodel.picture.stick import Stick
from leo_diffmodel.report.text import source
from leo_sim.description.robot import Robot

if TYPE_CHECKING:
    from leo_diffmodel.watch.state import State

Columns = dict[str, Array]
DEEPEST = 0.1  # of the floor: errors below, as on data without noise, leave the picture
GHOSTS = (
    ('given', palette.GIVEN, 4, 0.75),
    ('repaired', palette.REPAIRED, 4, 0.75),
    ('measured', palette.MEASURED, 3, 1.0),
)
"""The robots as drawn, with the width [px] and the opacity of their lines."""
MODELS = ('given', palette.GIVEN, 'as given'), ('now', palette.REPAIRED, 'with the switches')
"""Columns of errors, with their strokes and names."""
ASPECT = 1.35  # width of what is looked at over its height
ROOM = 1.15  # half its height over the reach of the robot
POSES = 100  # of the recordings: how far the robot reaches
FAR = 20.0  # times the reach; what lies beyond is drawn there
FILM_SECONDS = 4.0


class Stage:
    """Where poses are drawn [m], from the mount, or from the middle of a robot that walks."""

    def __init__(self, robot: Robot, recordings: Sequence[Recording]) -> None:
        self.stick = Stick(robot)
        q = np.concatenate([e.q for r in recordings for e in r.episodes])
        some = q[np.linspace(0, len(q) - 1, POSES).astype(int)]
        from_middle = (self._points(angles) - self._middle(angles) for angles in some)
        self.reach = max(float(np.linalg.norm(ways, axis=1).max()) for ways in from_middle)

    def lines(self, q: Array) -> list[Array]:
        far = FAR * self.reach
        return [np.clip(p, -far, far) for p in self.stick.lines(q)]

    def touched(self, q: Array) -> Array:
        return self.stick.pose(q).touched

    def part(self, q: Array) -> tuple[Array, Array]:
        """The lower left and the upper right corner of what to look at; a walker is followed."""
        middle, half = self._middle(q), ROOM * self.reach * np.array([ASPECT, 1.0])
        return middle - half, middle + half

    def _points(self, q: Array) -> Array:
        return np.concatenate([points for points, _ in self.stick.sticks(q)])

    def _middle(self, q: Array) -> Array:
        return self._points(q).mean(axis=0) if self.stick.root is None else self.stick.root


@dataclass(frozen=True)
class View:
    title: str
    error: str
    switched: tuple[str, ...]
    unit: str  # the state whose error is shown, with its unit
    seconds: float  # how far ahead the ghosts are predicted [s]
    stage: Stage
    times: Array  # of the pictures on the timeline [s], shape (F,)
    places: tuple[str, ...]  # these times as bag and bag time
    poses: Array  # joint angles as given, with the switches, as measured, shape (F, 3, J)
    horizon: Columns  # of `against_horizon`
    time: Columns  # of `over_time`
    worst: Columns  # of `worst`
    held: Columns  # of `held`


def view_of(state: State, times: Array) -> View:
    scene, film, (before, after, _) = state.scene, state.film, state.sizes
    return View(
        title=f'{scene.given.robot.name}: {source(scene.recordings)}',
        error=f'{before:.2f} → {after:.2f} noise floors, held out, {scene.headline.short}',
        switched=_switched(state),
        unit=unit(state),
        seconds=state.horizon,
        stage=Stage(scene.model.robot, scene.recordings),
        times=times,
        places=tuple(scene.timeline.words(float(t)) for t in times),
        poses=np.array([film.frame(float(t)) for t in times]),
        horizon=against_horizon(state),
        time=over_time(state),
        worst=worst(state),
        held=held(state),
    )


def now(state: State) -> Array:
    return np.array([state.player.now])


def from_now(state: State) -> Array:
    """The times of a film at the speed that is chosen [s]; to the end where less is left."""
    step, count = state.player.speed / RATE, round(FILM_SECONDS * RATE)
    begin = max(0.0, min(state.player.now, state.player.length - step * count))
    times = begin + step * np.arange(count + 1)
    return times[times <= state.player.length]


def _switched(state: State) -> tuple[str, ...]:
    lines = []
    for label in state.setting.on:
        lines.append(f'{label.replace(":", " at ")}: {", ".join(state.in_print(label))}')
    if state.setting.refitted and state.answer and (moved := state.answer.data['constants']):
        lines.append(f'refitted by the explanation: {", ".join(moved)}')
    return tuple(lines) or ('nothing is switched on',)


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
    """The worst windows with what is on: time, when poses are most apart, error, worst first."""
    film, i = state.film, state.shown
    at = film.worst(i)
    return {
        'time': film.middle[at],
        'apart': film.apart()[at],
        'error': film.error(film.repaired, i)[at],
    }


def held(state: State) -> Columns:
    """Begin and end of each held-out window of the film, each (N,)."""
    film = state.film
    begin, *_, end = film.time[state.scene.blocks.held(film.windows)].T
    return {'begin': begin, 'end': end}


def unit(state: State) -> str:
    shown = state.states[state.shown]
    return f'{shown["name"]} [{shown["unit"]}]'
