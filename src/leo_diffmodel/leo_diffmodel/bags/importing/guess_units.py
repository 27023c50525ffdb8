# SPDX-License-Identifier: Apache-2.0
"""The unit of a column by its numbers, '?' where they may be in one as well as another."""

from collections.abc import Mapping, Sequence
from types import MappingProxyType
from typing import Any, NamedTuple

import numpy as np

from leo_msgs_py import units

from .log_format import Column

RADIANS = 4 * np.pi  # angles of joints seldom go beyond two turns
PER_CENT = 100.5
DEGREES = 720.0
FASTEST, SLOWEST = 20e3, 2.0  # rates at which robots are logged [Hz]
AGREES = 1.3  # units of a speed are six times apart and more; filters and gaps take less
TURNS = ('rad', 'deg', 'rev')
WAYS = (1.0, 100.0, 255.0, 1000.0, 1023.0, 4095.0)  # of hands, from open to closed or back
SPANS = 50  # a log is compared in so many parts, which are longer than its noise


class Unit(NamedTuple):
    """A unit and why, or what else a map says of a column: sign, scale and offset."""

    name: str
    why: str
    said: Mapping[str, Any] = MappingProxyType({})

    @property
    def entry(self) -> dict[str, Any]:
        return dict(self.said) or ({'unit': self.name} if self.name else {})


def of_angles(columns: Sequence[Column]) -> Unit:
    peak = peak_of(columns)
    if peak <= RADIANS:
        return Unit('rad', f'none is beyond {peak:.3g}, so radians')
    if is_clipped(columns):
        why = 'they end at exactly 100: per cent of the calibrated range'
        return Unit('?', f'{why}; scale: rad for 1 %, and no unit')
    if are_counts(columns) and peak > 360.0:
        return _of_counts(peak)
    if peak > DEGREES:
        return Unit('?', f'up to {peak:.4g}: counts of an encoder? then scale: rad for one')
    if peak > PER_CENT:
        why = f'up to {peak:.3g}: beyond two turns in rad, and beyond per cent'
        return Unit('deg', f'{why}; unit: rad for a joint that turns round')
    return Unit('?', f'up to {peak:.3g}: unit: deg, or of per cent of a range scale: rad for 1 %')


def _of_counts(peak: float) -> Unit:
    why = f'whole numbers up to {peak:.0f}'
    turn = 'of 4096 a turn, 2048 the middle (Dynamixel X, Feetech STS)'
    if 1023.0 < peak <= 4095.0:
        return Unit('', f'{why}: counts {turn}', {'scale': 0.00153398, 'offset': -3.14159})
    if peak > 4095.0:
        return Unit('?', f'{why}: counts of an encoder? then scale: rad for one')
    short = 'scale: 0.00511327, offset: -2.61799 of 1024 in 300 deg (Dynamixel AX)'
    return Unit('?', f'{why}: {short}; scale: 0.00153398, offset: -3.14159 {turn}; or deg')


def of_a_way(columns: Sequence[Column]) -> float:
    """Return the number that is the whole way of a hand, as 1, 100 or 255; 0 where none is."""
    peak, low = peak_of(columns), min(float(np.nanmin(c)) for c in columns)
    for whole in WAYS:
        most, least = (1.0, 0.85) if are_counts(columns) else (1.05, 0.95)
        ends = abs(low) <= 0.05 * whole and least * whole < peak <= most * whole
        if ends and (whole <= 100.0 or most == 1.0):
            return whole
    return 0.0


def are_counts(columns: Sequence[Column]) -> bool:
    known = np.concatenate([c[np.isfinite(c)] for c in columns])
    return bool((known >= 0).all() and (known == np.round(known)).all() and len({*known}) > 2)


def of_rates(t: Column, q: Column, dq: Column, names: Sequence[str]) -> Unit | None:
    """Return the unit in which a speed is the change of its angle in SI; None where none is."""
    ratio = _change_over_speed(t, q, dq)
    name = next((n for n in names if 1 / AGREES < ratio / units.parse(n).factor < AGREES), '')
    return Unit(name, f'in {name} it is the change of the position') if name else None


def of_turns(t: Column, q: Column, dq: Column) -> Unit | None:
    ratio = _change_over_speed(t, q, dq)
    name = next((n for n in TURNS if 1 / AGREES < ratio * units.parse(n).factor < AGREES), '')
    return Unit(name, f'its change in {name} is the speed') if name else None


def _change_over_speed(t: Column, q: Column, dq: Column) -> float:
    rows = np.isfinite(t) & np.isfinite(q) & np.isfinite(dq)
    t, q, dq = t[rows], q[rows], dq[rows]
    if len(t) < 2 * SPANS:
        return 0.0
    way = np.concatenate([[0.0], np.cumsum(np.diff(t) * (dq[1:] + dq[:-1]) / 2)])
    span = max(1, len(t) // SPANS)
    moved, logged = np.abs(q[span:] - q[:-span]), np.abs(way[span:] - way[:-span])
    moving = logged > 0.1 * logged.max(initial=0.0)
    return float(np.median(moved[moving] / logged[moving])) if moving.any() else 0.0


def of_time(column: Column) -> Unit:
    steps = np.diff(column[np.isfinite(column)])
    step = float(np.median(steps[steps > 0])) if (steps > 0).any() else 0.0
    for unit in ('s', 'ms', 'us', 'ns'):
        rate = 1 / (step * units.parse(unit).factor) if step else 0.0
        if SLOWEST <= rate <= FASTEST:
            return Unit(unit, f'{step:.4g} from row to row, so {rate:.4g} Hz')
    return Unit('?', f'{step:.4g} from row to row')


def is_clipped(columns: Sequence[Column]) -> bool:
    """Say whether values end at exactly 100, in two samples or more, as per cent do."""
    return peak_of(columns) == 100.0 and sum(int((np.abs(c) == 100.0).sum()) for c in columns) > 1


def peak_of(columns: Sequence[Column]) -> float:
    """Return the number farthest from 0, 0 without any."""
    return max((float(np.abs(c[np.isfinite(c)]).max(initial=0.0)) for c in columns), default=0.0)
