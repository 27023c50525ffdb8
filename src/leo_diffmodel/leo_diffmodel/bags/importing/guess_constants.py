# SPDX-License-Identifier: Apache-2.0
"""Constants of the robot in the head of a log, as a mass or a gain: lines of the map for them.

The unit is the one in which the number is nearest to what the robot's file says.
"""

from collections.abc import Iterator, Sequence
import re
from typing import Any, NamedTuple

import numpy as np

from leo_msgs_py import units

from .guess_columns import KnownRobot
from .guess_roles import words_of
from .log_format import Table

FAR = 5.0  # times what the robot's file says: beyond that it is something else
Entry = dict[str, Any]


class Figure(NamedTuple):
    """The words of a constant in logs, where a robot has it, and how it may be written."""

    words: str
    path: str
    ways: Sequence[Entry]


def _in(*names: str) -> Sequence[Entry]:
    return [{'unit': name} for name in names]


FIGURES = (
    Figure('mass masse payload weight gewicht', 'links.LINK.mass', _in('kg', 'g')),
    Figure('length laenge lange longueur', 'links.LINK.com_[xyz]', _in('m', 'mm', 'cm')),
    Figure('vin supply vbat battery', 'actuators.JOINT.supply', _in('V', 'mV')),
    Figure('kp', 'actuators.JOINT.stiffness', _in('N m/rad')),
    Figure(  # P of a Dynamixel X and of a Feetech STS3215: docs/your_robot.md
        'kp',
        'actuators.JOINT.position_gain',
        [*_in('1/rad'), {'scale': 0.00287738}, {'scale': 0.166}],
    ),
)


def constant_lines(table: Table, robot: KnownRobot | None) -> Iterator[tuple[str, Entry, str]]:
    """Yield (path, entry, why) of what the head of a log says; '' where no path is sure."""
    for name, values in table.items():
        if len({*values}) == 1 and np.isfinite(values[0]):
            able = [f for f in FIGURES if {*f.words.split()} & {*words_of(name)}]
            found = [row for f in able for row in _rows(f, name, float(values[0]), robot)]
            near = [row for row in found if row[0] <= FAR]
            if able and len({path for _, path, _ in near}) == 1:
                _, path, entry = min(near, key=lambda row: row[0])
                yield path, {'column': name, **entry}, f'{values[0]:.6g}'
            elif able:
                paths = ' or '.join({p: 0 for _, p, _ in found} or [f.path for f in able])
                yield '', {'column': name, **able[0].ways[0]}, f'{values[0]:.6g}: {paths}'


def _rows(
    figure: Figure, name: str, value: float, robot: KnownRobot | None
) -> Iterator[tuple[float, str, Entry]]:
    """Yield (times apart, path, entry) for each constant that it may be, and each way."""
    path = re.sub('LINK|JOINT', '[^.]+', figure.path)
    for own in robot.constants.values() if robot else ():
        if own.value and re.fullmatch(path, own.path):
            for way in figure.ways:
                factor = way.get('scale') or units.conversion(way['unit'], own.unit, name)
                apart = abs(np.log(abs(value * factor / own.value) or np.inf))
                sign = {'sign': -1} if value * own.value < 0 else {}
                yield float(np.exp(apart)), own.path, {**way, **sign}
