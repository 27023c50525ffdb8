# SPDX-License-Identifier: Apache-2.0
"""Constants of the robot in the head of a log, as a mass or a gain: lines of the map for them."""

from collections.abc import Iterator, Sequence
import re
from typing import Any

import numpy as np

from leo_msgs_py import units

from .guess_columns import KnownRobot
from .guess_roles import words_of
from .log_format import Table

FAR = 5.0  # times what the robot's file says: beyond that it is something else
Entry = dict[str, Any]
Figure = tuple[str, str, Sequence[Entry]]
FIGURES: Sequence[Figure] = (
    ('mass masse payload weight gewicht', 'links.LINK.mass', [{'unit': u} for u in ('kg', 'g')]),
    ('length lange longueur', 'links.LINK.com_[xyz]', [{'unit': u} for u in ('m', 'mm', 'cm')]),
    ('vin supply vbat battery', 'actuators.JOINT.supply', [{'unit': u} for u in ('V', 'mV')]),
    ('kp', 'actuators.JOINT.stiffness', [{'unit': 'N m/rad'}]),
    # P of a Dynamixel X and of a Feetech STS3215: docs/your_robot.md
    (
        'kp',
        'actuators.JOINT.position_gain',
        [{'unit': '1/rad'}, {'scale': 0.00287738}, {'scale': 0.166}],
    ),
)
"""Words of a constant in logs, where a robot has it, and ways to write it: the nearest counts."""


def constant_lines(table: Table, robot: KnownRobot | None) -> Iterator[tuple[str, Entry, str]]:
    """Yield (path, entry, why) of what the head of a log says; '' where none is sure or free."""
    taken = set[str]()
    for name, values in table.items():
        able = [f for f in FIGURES if {*f[0].split()} & {*words_of(name)}]
        if able and len({*values}) == 1 and np.isfinite(values[0]):
            found = [row for f in able for row in _rows(f, name, float(values[0]), robot)]
            near = [row for row in found if row[0] <= FAR]
            paths = {path for _, path, _ in near}
            if len(paths) == 1 and not paths & taken:
                _, path, entry = min(near, key=lambda row: row[0])
                taken.add(path)
                yield path, {'column': name, **entry}, f'{values[0]:.6g}'
            else:
                either = dict.fromkeys([p for _, p, _ in found] or [f[1] for f in able])
                why = f'{values[0]:.6g}: {" or ".join(either)}'
                yield '', {'column': name, **able[0][2][0]}, why


def _rows(
    figure: Figure, name: str, value: float, robot: KnownRobot | None
) -> Iterator[tuple[float, str, Entry]]:
    """Yield (times apart, path, entry) for each constant that it may be, and each way."""
    pattern = re.sub('LINK|JOINT', '[^.]+', figure[1])
    for own in robot.constants.values() if robot else ():
        is_same = units.same_dimension(figure[2][0]['unit'], own.unit)
        if own.value and is_same and re.fullmatch(pattern, own.path):
            for way in figure[2]:
                factor = way.get('scale') or units.conversion(way['unit'], own.unit, name)
                ratio = abs(value * factor / own.value)
                apart = max(ratio, 1 / ratio) if ratio else np.inf
                yield apart, own.path, way | ({'sign': -1} if value * own.value < 0 else {})
