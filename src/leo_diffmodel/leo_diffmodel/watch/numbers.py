# SPDX-License-Identifier: Apache-2.0
"""The numbers behind the view, as CSV: one line a figure, each with its unit."""

from __future__ import annotations

from collections.abc import Iterator
import csv
import io

from leo_diffmodel.watch.state import State

HEAD = ('what', 'of', 'at', 'at_unit', 'as_given', 'now', 'noise_floor', 'unit')


def table(state: State) -> str:
    """Errors against horizon and over time of every state, and the values that are set."""
    out = io.StringIO()
    writer = csv.writer(out, lineterminator='\n')
    writer.writerow(HEAD)
    writer.writerows([*_values(state), *_horizon(state), *_time(state)])
    return out.getvalue()


def _values(state: State) -> Iterator[tuple]:
    for label, values in state.setting.on.items():
        for p in state.scene.candidates[label].parameters:
            yield 'value', f'{label} {p.name}', '', '', p.neutral, values[p.name], '', p.unit


def _horizon(state: State) -> Iterator[tuple]:
    rows = zip(state.given.rows, state.now.rows, state.floor.rows, strict=True)
    for before, after, floor in rows:
        for i, s in enumerate(state.states):
            yield ('held-out rms error', s['name'], before['seconds'], 's ahead',
                   before['rmse'][i], after['rmse'][i], floor['noise_floor'][i],
                   s['unit'])  # fmt: skip


def _time(state: State) -> Iterator[tuple]:
    film = state.film
    for i, s in enumerate(state.states):
        both = film.error(film.given, i), film.error(film.repaired, i)
        for time, before, after in zip(film.middle, *both, strict=True):
            yield (f'rms error over {state.horizon:g} s', s['name'], time, 's on the timeline',
                   before, after, '', s['unit'])  # fmt: skip
