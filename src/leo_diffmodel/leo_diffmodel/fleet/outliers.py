# SPDX-License-Identifier: Apache-2.0
"""What each robot of a fleet was found to have, and which robots stand out in it."""

from collections.abc import Callable, Iterator, Mapping
from typing import Any, NamedTuple

import numpy as np

SPREADS = 3.5
"""Robust standard deviations of the fleet (1.4826 times the median absolute deviation) from its
median: beyond them a value is an outlier (Iglewicz and Hoaglin 1993), one in 2000 normal ones."""
NORMAL = 1.4826  # standard deviation of normal values, by their median absolute deviation


class Figure(NamedTuple):
    what: str  # coulomb_friction:pivot, links.bob.mass
    parameter: str = ''
    unit: str = ''

    def __str__(self) -> str:
        return ' '.join(filter(None, (self.what, self.parameter)))


Off = Callable[[Figure], float | None]
"""The value at which an effect does nothing; None of what has none, as a constant."""


def fleet(answers: Mapping[str, dict], off: Off) -> list[dict[str, Any]]:
    """A row for each figure that any robot has, those that most differ in first.

    A robot whose data would have shown an effect that was not named has its value `off`.
    """
    searched = {name: a for name, a in answers.items() if a['effects'] or a['hypotheses']}
    found = {name: dict(_figures(answer)) for name, answer in searched.items()}
    rows = []
    for figure in dict.fromkeys(f for own in found.values() for f in own):
        robots = {
            name: own[figure] if figure in own else {'value': off(figure), 'ci95': None}
            for name, own in found.items()
            if figure in own or _seen(searched[name], figure.what)
        }
        rows.append(_row(figure, {n: r for n, r in robots.items() if r['value'] is not None}))
    return sorted(rows, key=lambda row: -len(row['stand_out']))


def _figures(answer: dict) -> Iterator[tuple[Figure, dict]]:
    for e in [*answer['effects'], *answer.get('not_sure', [])]:
        for name, p in e['parameters'].items():
            yield Figure(f'{e["name"]}:{e["where"]}', name, p['unit']), _value(p)
    for path, p in answer['constants'].items():
        yield Figure(path, unit=p['unit']), _value(p)


def _value(row: dict) -> dict:
    return {'value': row['value'], 'ci95': row['ci95']}


def _seen(answer: dict, what: str) -> bool:
    return what not in {f'{row["name"]}:{row["where"]}' for row in answer['not_testable']}


def _row(figure: Figure, robots: Mapping[str, dict]) -> dict[str, Any]:
    values = np.array([robot['value'] for robot in robots.values()])
    median = float(np.median(values))
    spread = NORMAL * float(np.median(np.abs(values - median)))
    far = [name for name, robot in robots.items() if _stands_out(robot, median, spread)]
    told = {**figure._asdict(), 'median': median, 'spread': spread}
    return {**told, 'stand_out': far, 'robots': dict(robots)}


def _stands_out(robot: dict, median: float, spread: float) -> bool:
    low, high = robot['ci95'] or (robot['value'], robot['value'])
    return not low <= median <= high and abs(robot['value'] - median) > SPREADS * spread
