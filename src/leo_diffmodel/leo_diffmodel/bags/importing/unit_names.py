# SPDX-License-Identifier: Apache-2.0
"""Units as heads of logs write them, in English, German and French, to units as they are known."""

from collections.abc import Mapping, Sequence
import re

from leo_msgs_py import units
from leo_msgs_py.errors import UserError


def by_word(spellings: Mapping[str, str]) -> dict[str, str]:
    return {word: meaning for meaning, words in spellings.items() for word in words.split()}


_PARTS = by_word(
    {
        'deg': '° º grad degree degrees degré degrés',
        'rad': 'radian radians radiant',
        'rev': 'u umdr umdrehungen tr tour tours turn turns',
        's': 'sec sek second seconds sekunden secondes',
        'ms': 'msec millis',
        'us': 'usec micros',
        'V': 'volt volts v',
        'mV': 'mv',
        'A': 'ampere amps a',
        'mA': 'ma',
        'N cm': 'ncm',
        'mN m': 'mnm',
        'N': 'newton n',
        'm': 'meter metre',
    }
)
_WHOLE = by_word(
    {
        'rpm': 'rev/min 1/min min-1 min^-1',
        'rev/s': 'rps',
        'rad/s': 'rads radps',
        'deg/s': 'degs dps',
        'm/s': 'mps',
        '1/s': 's-1',
        '%': 'prozent percent',
        'N m': 'nm n*m n.m n·m',
    }
)
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
    return bool(text) and _is_known(canonical(text))


def fits(unit: str, targets: Sequence[str]) -> bool:
    return any(units.same_dimension(unit, target) for target in targets if target != 'degC')


def _is_known(text: str) -> bool:
    try:
        units.parse(text)
    except UserError:
        return False
    return bool(text)
