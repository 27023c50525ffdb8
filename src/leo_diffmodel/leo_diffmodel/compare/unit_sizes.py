# SPDX-License-Identifier: Apache-2.0
"""What is large in a unit on some robot, told by what is large of the quantities in it."""

from __future__ import annotations

from dataclasses import dataclass
from math import isfinite

from leo_msgs_py.errors import UserError
from leo_msgs_py.units import powers
from leo_sim.effects import Parameter

SYMBOLS = ('N', 'm', 's', 'rad', 'kg', 'V')
COUNTS = ('', '1', '1/turn', '1/m')
"""Units of plain numbers: shares, scales, how often in a turn (on a slide in 2 pi m)."""


@dataclass(frozen=True)
class UnitSizes:
    """What is large of each quantity; seconds are what an angle takes at a rate, a way at a speed.

    Attributes:
        torque: N m.
        rate: rad/s.
        angle: rad.
        force: N.
        speed: m/s.
        length: m.
        inertia: kg m2.
        mass: kg.
        input: at a motor [V].
    """

    torque: float
    rate: float
    angle: float
    force: float
    speed: float
    length: float
    inertia: float
    mass: float
    input: float

    def of(self, unit: str) -> float | None:
        """Large in a unit: torque / rate in N m s/rad; None where the unit has other symbols.

        With rad, or with N and m as N m, it is one of turning; otherwise one of sliding.
        """
        if unit in COUNTS:
            return 1.0
        if unit == 'kg m2':
            return self.inertia
        power = powers(unit.replace('Nm', 'N m'))
        if power.keys() - {*SYMBOLS, '1'}:
            return None
        n, m, s, rad, kg, v = (power.get(symbol, 0) for symbol in SYMBOLS)
        size = self.mass**kg * self.input**v
        if rad or m == n:
            return (
                size
                * self.torque**n
                * self.length ** (m - n)
                / self.rate**s
                / self.angle ** -(s + rad)
            )
        return size * self.force**n / self.speed**s / self.length ** -(s + m)

    def large(self, effect: str, parameter: Parameter) -> float:
        """Large for a parameter: by its unit, else the span of its bounds; UserError without."""
        known = self.of(parameter.unit)
        if known is not None:
            return known
        if isfinite(parameter.high - parameter.low):
            return parameter.high - parameter.low
        raise UserError(
            f'{effect}.{parameter.name}: how large is large in {parameter.unit!r}? '
            f'Give it low and high, or a unit of {", ".join(SYMBOLS)}'
        )
