# SPDX-License-Identifier: Apache-2.0
"""Numbers, units, labels and names of bags as in print."""

from collections.abc import Mapping
import math
import re
from typing import Any

from markupsafe import escape, Markup

from leo_diffmodel.bags.recording import Recordings

RAISED = str.maketrans('0123456789-', '⁰¹²³⁴⁵⁶⁷⁸⁹⁻')
LABEL = re.compile(r'\b[a-z][a-z0-9_]*:[A-Za-z0-9_]+')
UNIT = re.compile(r'\bkg m2|\b(?:N m|N|m|rad) ?s?[23]?/(?:rad|s|m)[23]?\b')
"""Units with powers, as they stand in a sentence."""
TENTH_OF_A_PERCENT = 0.0005
UNDETERMINED = 1e3
SMALLEST_PLAIN, LARGEST_PLAIN = -3, 4
LEAST_TORQUE = 1e-12  # less is printed without a prefix [N m]


def unit(text: str) -> str:
    """A unit with raised powers: `kg m2` becomes kg m², `ohm` Ω, `degC` °C."""
    raised = re.sub(r'(?<=[A-Za-z])([23])\b', lambda m: m[1].translate(RAISED), text)
    return raised.replace('ohm', 'Ω').replace('degC', '°C')


def number(value: float | None, digits: int = 3) -> str:
    """A number with `digits` significant digits, as a power of ten where it is very small."""
    if value is None or not math.isfinite(value):
        return '–'
    if value == 0:
        return '0'
    power = _power(value)
    if SMALLEST_PLAIN <= power <= LARGEST_PLAIN:
        return _minus(f'{value:.{max(0, digits - 1 - power)}f}')
    return _minus(f'{value / 10.0**power:.{digits - 1}f}') + _ten(power)


def quantity(value: float | None, of: str, digits: int = 3) -> str:
    return f'{number(value, digits)}\u00a0{unit(of)}'.rstrip()


def prefix(size: float) -> tuple[float, str]:
    if size >= 0.1 or size == 0.0:
        return 1.0, ''
    return (1e3, 'm') if size >= 1e-4 else (1e6, 'µ')


def torque(value: float | None, digits: int = 3, of: str = 'N m') -> str:
    """A torque (of a slide: a force), with a prefix m or µ where that reads better."""
    if value is None or not math.isfinite(value):
        return '–'
    scale, si = prefix(abs(value)) if abs(value) >= LEAST_TORQUE else (1.0, '')
    return quantity(scale * value, f'{si}{of}', digits)


def span(low: float, high: float, of: str = '') -> str:
    """Two ends with as many decimals as two digits of their distance take."""
    width = abs(high - low) or abs(high) or 1.0
    places = max(0, 1 - _power(width))
    if places > 6:
        return f'{number(low, 2)} … {quantity(high, of, 2)}'
    ends = ' … '.join(_minus(f'{0.0 + round(end, places):.{places}f}') for end in (low, high))
    return f'{ends}\u00a0{unit(of)}'.rstrip()


def nats(value: float | None) -> str:
    """A gain in log-likelihood: to a twentieth, thousands set apart by thin spaces."""
    if value is None or not math.isfinite(value):
        return '–'
    if abs(value) < 1000:
        return number(value) if abs(value) >= 0.05 else '0'
    return _minus(f'{value:,.0f}'.replace(',', '\u202f'))


def change(before: float, after: float) -> str:
    ratio = after / before - 1
    return ('+' if ratio >= TENTH_OF_A_PERCENT else '') + percent(ratio)


def percent(share: float | None) -> str:
    if share is None or not math.isfinite(share):
        return '–'
    if abs(share) < TENTH_OF_A_PERCENT:
        return '0 %'
    places = 1 if abs(share) < 0.0995 or 0.99 < share < 1 - TENTH_OF_A_PERCENT else 0
    return _minus(f'{100 * share:.{places}f} %')


def estimate(parameter: Mapping[str, Any]) -> str:
    """Value, 95 % interval and unit of one fitted parameter; the interval's ends if lopsided."""
    value, (low, high) = parameter['value'], parameter['ci95']
    half, of = 0.5 * (high - low), unit(parameter['unit'])
    alone = f'{number(value)} {of}'.rstrip()
    if not half > 0 or half > UNDETERMINED * max(abs(value), 1.0):
        return f'{alone} (not determined)'
    if value in (low, high):
        return f'{alone} (at its bound, or up to {number(high if value == low else low)})'
    if abs(0.5 * (low + high) - value) > 0.1 * half:
        return f'{alone} ({number(low)} … {number(high)})'
    return f'{_plus_minus(value, half)} {of}'.rstrip()


def estimates(parameters: Mapping[str, Mapping[str, Any]]) -> list[str]:
    """`name = value ± interval unit` of every parameter of an effect."""
    return [f'{name} = {estimate(p)}' for name, p in parameters.items()]


def source(recordings: Recordings) -> str:
    first, *others = recordings
    return f'{first.path.name} and {len(others)} more' if others else first.path.name


def numbered(recordings: Recordings) -> list[str]:
    """What the page calls each bag: #1, #2 and so on; nothing where there is only one."""
    several = len(recordings) > 1
    return [f'#{i + 1}' if several else '' for i in range(len(recordings))]


def label(row: Mapping[str, Any]) -> str:
    """An effect and its place as typed on the command line."""
    return f'{row["name"]}:{row["where"]}'


def prose(text: str) -> Markup:
    """A sentence as HTML: escaped, effects set apart, arrows and units as in print."""
    plain = UNIT.sub(lambda match: unit(match[0]), text.replace('->', '→'))
    plain = re.sub(r'(?<![\w.])-(?=[\d.])', '−', plain)
    return Markup(LABEL.sub(r'<b class="effect">\g<0></b>', str(escape(plain))))


def _plus_minus(value: float, half: float) -> str:
    power = _power(value) if value else _power(half)
    plain = SMALLEST_PLAIN <= power <= LARGEST_PLAIN
    scale = 1.0 if plain else 10.0**power
    shown = half / scale
    places = max(0, 1 - _power(shown)) if shown > 0 else 3
    both = f'{_minus(f"{value / scale:.{places}f}")} ± {shown:.{places}f}'
    return both if plain else f'({both}){_ten(power)}'


def _power(value: float) -> int:
    return math.floor(math.log10(abs(value)) + 1e-9) if value else 0


def _ten(power: int) -> str:
    return f'\u00a0×\u00a010{str(power).translate(RAISED)}'


def _minus(text: str) -> str:
    return text.replace('-', '−')
