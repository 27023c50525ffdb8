# SPDX-License-Identifier: Apache-2.0
"""Units of files and foreign logs: 'N m s/rad' checked by dimension, 'deg' or 'mA' converted.

A unit is a product of symbols, each with an optional power, and at most one slash: 'kg m2',
'N m s2/rad2', '1'. Angles count as numbers, so that V s/rad equals N m/A.
"""

from functools import cache
import math
import re
from typing import NamedTuple

from leo_msgs_py.errors import UserError
from leo_msgs_py.names import nearest

# symbol -> factor to SI, powers of m, kg, s, A
_SYMBOLS: dict[str, tuple[float, tuple[int, int, int, int]]] = {
    '1': (1.0, (0, 0, 0, 0)),
    'rad': (1.0, (0, 0, 0, 0)),
    'deg': (math.pi / 180.0, (0, 0, 0, 0)),
    'rev': (2.0 * math.pi, (0, 0, 0, 0)),
    '%': (0.01, (0, 0, 0, 0)),
    'm': (1.0, (1, 0, 0, 0)),
    'kg': (1.0, (0, 1, 0, 0)),
    's': (1.0, (0, 0, 1, 0)),
    'A': (1.0, (0, 0, 0, 1)),
    'g': (1e-3, (0, 1, 0, 0)),
    'min': (60.0, (0, 0, 1, 0)),
    'rpm': (2.0 * math.pi / 60.0, (0, 0, -1, 0)),
    'Hz': (1.0, (0, 0, -1, 0)),
    'N': (1.0, (1, 1, -2, 0)),
    'Nm': (1.0, (2, 1, -2, 0)),
    'W': (1.0, (2, 1, -3, 0)),
    'V': (1.0, (2, 1, -3, -1)),
    'ohm': (1.0, (2, 1, -3, -2)),
    'H': (1.0, (2, 1, -2, -2)),
}
_PREFIXES = {'n': 1e-9, 'u': 1e-6, 'm': 1e-3, 'c': 1e-2, 'k': 1e3}
_NO_PREFIX = {'1', '%', 'deg', 'rev', 'min', 'rpm', 'kg'}
_FACTOR = re.compile(r'(1|%|[A-Za-z]+)(?:\^?(-?\d+))?')


class Unit(NamedTuple):
    """Factor to SI and powers of m, kg, s, A."""

    factor: float
    powers: tuple[int, ...]


@cache
def parse(text: str) -> Unit:
    """Unit written as text. UserError: a symbol nobody knows, naming the nearest known."""
    factors = [(_symbol(symbol, text), power) for symbol, power in powers(text).items()]
    factor = math.prod(unit.factor**power for unit, power in factors)
    return Unit(factor, tuple(sum(u.powers[i] * p for u, p in factors) for i in range(4)))


def powers(text: str) -> dict[str, int]:
    """The power of each symbol: N 1, m 1, s 1 and rad -1 of 'N m s/rad'. UserError for no unit."""
    above, *below = text.strip().split('/')
    if len(below) > 1:
        raise UserError(f'unit {text!r} has two slashes; write it like N m s/rad')
    found: dict[str, int] = {}
    for part, sign in ((above, 1), *((part, -1) for part in below)):
        for symbol, power in _factors(part, text):
            found[symbol] = found.get(symbol, 0) + sign * power
    return found


def same_dimension(unit: str, other: str) -> bool:
    return parse(unit).powers == parse(other).powers


def conversion(unit: str, target: str, what: str) -> float:
    """What a value in `unit` is to be multiplied with to be in `target`.

    UserError, which names the value by `what`, where the dimensions differ.
    """
    if not same_dimension(unit, target):
        raise UserError(f'{what} is in {unit!r}, which is no unit of it; give it in {target!r}')
    return parse(unit).factor / parse(target).factor


def _factors(text: str, whole: str) -> list[tuple[str, int]]:
    found = []
    for word in re.split(r'[\s*·]+', text.strip()):
        match = _FACTOR.fullmatch(word)
        if word and not match:
            raise UserError(f'unit {whole!r} has {word!r}, which is no unit')
        if match:
            found.append((match[1], int(match[2] or 1)))
    return found


def _symbol(symbol: str, whole: str) -> Unit:
    if symbol in _SYMBOLS:
        return Unit(*_SYMBOLS[symbol])
    prefix, base = symbol[0], symbol[1:]
    if prefix in _PREFIXES and base in _SYMBOLS and base not in _NO_PREFIX:
        factor, powers = _SYMBOLS[base]
        return Unit(_PREFIXES[prefix] * factor, powers)
    raise UserError(f'unit {whole!r}: {symbol!r} is not known{nearest(symbol, _SYMBOLS)}')
