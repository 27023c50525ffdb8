# SPDX-License-Identifier: Apache-2.0
"""Units as heads of logs write them, in English, German and French, to units as they are known."""

from __future__ import annotations

from collections.abc import Sequence
import re

from leo_msgs_py import units
from leo_msgs_py.errors import UserError

_PARTS = {
    '°': 'deg',
    'º': 'deg',
    'grad': 'deg',
    'degree': 'deg',
    'degrees': 'deg',
    'degré': 'deg',
    'degrés': 'deg',
    'radian': 'rad',
    'radians': 'rad',
    'radiant': 'rad',
    'u': 'rev',
    'umdr': 'rev',
    'umdrehungen': 'rev',
    'tr': 'rev',
    'tour': 'rev',
    'tours': 'rev',
    'turn': 'rev',
    'turns': 'rev',
    'sec': 's',
    'sek': 's',
    'second': 's',
    'seconds': 's',
    'sekunden': 's',
    'secondes': 's',
    'msec': 'ms',
    'millis': 'ms',
    'usec': 'us',
    'micros': 'us',
    'volt': 'V',
    'volts': 'V',
    'ampere': 'A',
    'amps': 'A',
    'v': 'V',
    'ncm': 'N cm',
    'mnm': 'mN m',
    'newton': 'N',
    'n': 'N',
    'meter': 'm',
    'metre': 'm',
    'a': 'A',
    'mv': 'mV',
    'ma': 'mA',
}
_WHOLE = {
    'rev/min': 'rpm',
    '1/min': 'rpm',
    'min-1': 'rpm',
    'min^-1': 'rpm',
    'rps': 'rev/s',
    'rads': 'rad/s',
    'radps': 'rad/s',
    'degs': 'deg/s',
    'dps': 'deg/s',
    'mps': 'm/s',
    's-1': '1/s',
    'prozent': '%',
    'percent': '%',
    'nm': 'N m',
    'n*m': 'N m',
    'n.m': 'N m',
    'n·m': 'N m',
}
"""Whole units; a speed in 1/min counts turns, and nm is no length of a robot."""
_SPELLING = str.maketrans({'µ': 'u', 'μ': 'u', '²': '2', '⁻': '-', '¹': '1', '⋅': '·', '∙': '·'})


def canonical(unit: str) -> str:
    """Return a unit as `leo_msgs_py.units` writes it; one it does not know comes back as it is."""
    text = re.sub(r'\s+', ' ', unit.translate(_SPELLING).strip())
    text = _WHOLE.get(text.lower(), text)
    if _is_known(text):
        return text
    text = re.sub(r'\s*(/|\bper\b|\bpro\b|\bpar\b)\s*', '/', text, flags=re.IGNORECASE)
    parts = [_PARTS.get(part.rstrip('.').lower(), part) for part in text.split('/')]
    found = _WHOLE.get('/'.join(parts).lower(), '/'.join(parts))
    return found if _is_known(found) else unit


def is_unit(text: str) -> bool:
    """Say whether a text is a unit, in one of the spellings."""
    return bool(text) and _is_known(canonical(text))


def fits(unit: str, targets: Sequence[str]) -> bool:
    """Say whether values in a known unit can be given in one of the targets."""
    return any(units.same_dimension(unit, target) for target in targets if target != 'degC')


def _is_known(text: str) -> bool:
    try:
        units.parse(text)
    except UserError:
        return False
    return bool(text)
