# SPDX-License-Identifier: Apache-2.0
"""What a column is by the words of its name, in English, German and French: quantity, unit, joint.

`goal_position_elbow [deg]`, `shoulder_pan.pos`, `Sollwinkel`: words, abbreviations and symbols as
logs have them.
"""

from collections import defaultdict
from collections.abc import Iterable, Mapping, Sequence
import re
from typing import NamedTuple
import unicodedata

import numpy as np

from .column_map import QUANTITIES
from .log_format import Table
from .unit_names import by_word, canonical, fits, is_unit


def _words(text: str) -> set[str]:
    return set(text.split())


WORDS = {
    'error': 'err error errors deviation residual fehler abweichung regelabweichung erreur ecart',
    'time': 't time timestamp timestamps stamp clock sec secs seconds zeit zeitstempel temps '
    'instant horodatage',
    'supply_voltage': 'supply battery vbat vbus versorgung versorgungs akku batterie alimentation',
    'acceleration': 'ddq qdd ddot acc accel acceleration beschleunigung',
    'velocity': 'vel velocity velocities speed speeds dq qd qdot qvel dot dtheta dphi rate omega '
    'drehzahl geschwindigkeit vitesse',
    'effort': 'tau torque torques effort efforts force moment kraft couple',
    'voltage': 'voltage volt volts spannung tension',
    'position': 'pos position positions angle angles q theta phi state winkel lage stellung weg '
    'auslenkung qpos',
    'current': 'strom courant current amps',
}
"""Words of each quantity, the surer ones first."""
MEANING = by_word(WORDS)
SYMBOLS = by_word(
    {'position': 'x s', 'velocity': 'v w n', 'effort': 'f m', 'voltage': 'u', 'current': 'i'}
)
"""Letters of formulas: they count where the unit is one of the quantity."""
ANGLES = _words('angle angles theta phi dtheta dphi omega winkel drehzahl')
"""Words of what turns: next to them a unit of lengths is another word."""
GOAL = _words(
    'action actions goal goals target targets command commands commanded cmd desired des ref '
    'reference setpoint wanted demand demanded soll sollwert ziel vorgabe consigne cible commande'
)
BESIDES = _words(
    'observation measured meas present actual joint jnt j axis state ist istwert gemessen mesure '
    'mesuree gelenk achse axe articulaire angulaire angular dreh reel reelle de des du le la der '
    'die das am observations obs data controller states'
)
"""Words that are no name of a joint."""
ENABLED = _words('enable enabled on active activated freigabe aktiv actif')
"""Words of a flag that says whether a motor is on."""
HANDS = _words('gripper grippers hand hands finger fingers thumb claw jaw greifer pince')
MOTORS = ('motor', 'motors', 'servo', 'servos', 'drive')  # what a flag of all may name
_PARTS = sorted(
    _words(
        'soll ist ziel dreh gelenk motor winkel drehzahl geschwindigkeit moment kraft spannung '
        'strom lage stellung position wert versorgungs akku'
    ),
    key=len,
    reverse=True,
)
"""Of German compounds."""
ANYWHERE = _words('deg degree degrees rad radians ms us ns rpm nm mv')
"""Words that are units wherever they stand in a name."""
LAST = {
    ending: canonical(ending.replace('_per_', '/').replace('_', '/'))
    for ending in _words(
        'rad_s rad_per_s rad_per_sec rads radps deg_s deg_per_s deg_per_sec degs dps m_s m_per_s '
        'mps mm_s rev_s rev_min u_min tr_min mnm ncm mm cm ma sec'
    )
} | {'n_m': 'N m', 'rad_s_2': 'rad/s2', 'm_s_2': 'm/s2'}
"""Words that are a unit where a name ends in them."""
BY_UNIT = ('velocity', 'effort', 'voltage', 'current', 'position')  # that a unit alone shows
_IN_BRACKETS = re.compile(r'[\[(]\s*([^\])]*?)\s*[\])]\s*$')
_INDEX = re.compile(r'\S\[\d+\]$')  # q[1], but no 'duty [1]'
_COMPOUND = re.compile(f'(?:{"|".join(_PARTS)})+')
_PART = re.compile('|'.join(_PARTS))
_WORD = re.compile(r'[^\W\d_]+|\d+')
_CAMEL = re.compile(r'(?<=[a-z])(?=[A-Z][a-z])')


class Role(NamedTuple):
    """What a column is by its name; '' for what that does not say, quantities as in `WORDS`."""

    quantity: str
    is_goal: bool
    joint: str
    unit: str


def role_of(column: str) -> Role:
    """Return what the words of a column's name say; a goal of nothing is one of a position."""
    name, unit, letter = _unit(column)
    words = words_of(name)
    is_goal = bool(GOAL & set(words))
    quantity = _quantity(words, unit, letter)
    turns = letter == 'm' and ANGLES & set(words)
    if letter and (turns or not fits_quantity(letter, quantity)):
        words, letter = words + [letter.lower()], ''
    spent = {*MEANING, *GOAL, *BESIDES, *(SYMBOLS if unit or letter else ())}
    joint = '_'.join(word for word in words if word not in spent)
    joint = f'joint{joint}' if joint.isdecimal() else joint
    return Role(quantity or ('position' if is_goal else ''), is_goal, joint, unit or letter)


def roles_of(columns: Iterable[str]) -> dict[str, Role]:
    """Return the roles of a log's columns; what all begin with, as `run.`, is no joint."""
    names = list(columns)
    first = names[0].split('.')[0] + '.' if names else ''
    common = first if len(names) > 1 and all(name.startswith(first) for name in names) else ''
    return _without_topics({name: role_of(name.removeprefix(common)) for name in names})


def _without_topics(roles: dict[str, Role]) -> dict[str, Role]:
    """Return joints without what is before a dot in all columns of a quantity, as a topic is."""
    families = defaultdict[tuple[str, bool], list[set[str]]](list)
    for name, role in roles.items():
        if role.quantity in BY_UNIT:
            families[role[:2]].append({*name.split('.')[:-1]})
    shared = [set.intersection(*parts) for parts in families.values()]
    some = (
        set.union(*parts) - all_of for parts, all_of in zip(families.values(), shared, strict=True)
    )
    topics = set().union(*shared).difference(*some)
    for name, role in roles.items():
        rest = '.'.join(part for part in name.split('.') if part not in topics)
        if role.quantity in BY_UNIT and rest != name:
            roles[name] = role._replace(joint=role_of(rest).joint or role.joint)
    return roles


def is_bare_goal(column: str) -> bool:
    name, unit, letter = _unit(column)
    words = words_of(name)
    return bool(GOAL & set(words)) and not _quantity(words, unit, letter)


def as_taken(roles: Mapping[str, Role], takes: str) -> dict[str, Role]:
    """Return goals of nothing as ones of what a robot takes, where no name says that quantity."""
    bare = {n for n, role in roles.items() if role.quantity == 'position' and is_bare_goal(n)}
    if any(roles[name].quantity == takes for name in roles.keys() - bare):
        return dict(roles)
    return {n: r._replace(quantity=takes) if n in bare else r for n, r in roles.items()}


def with_flags(roles: Mapping[str, Role], table: Table) -> dict[str, Role]:
    """Return the roles with flags, as `torque_enable`: of a joint, or where none is named all."""
    found = dict(roles)
    for name, role in roles.items():
        numbers = set(table[name][np.isfinite(table[name])])
        if not role.unit and numbers <= {0.0, 1.0} and ENABLED & set(words_of(name)):
            joint = '_'.join(word for word in role.joint.split('_') if word not in ENABLED)
            found[name] = Role('enabled', False, '' if joint in MOTORS else joint, '')
    return found


def plain(word: str) -> str:
    text = unicodedata.normalize('NFKD', word.lower())
    return ''.join(sign for sign in text if not unicodedata.combining(sign))


def words_of(name: str) -> list[str]:
    words = map(plain, _WORD.findall(_CAMEL.sub('_', name)))
    return [p for w in words for p in (_PART.findall(w) if _COMPOUND.fullmatch(w) else [w])]


def fits_quantity(unit: str, quantity: str) -> bool:
    return fits(unit, QUANTITIES.get(quantity, ()))


def _unit(column: str) -> tuple[str, str, str]:
    """Return (the name without its unit, the unit, or a last letter that may be one)."""
    inside = _IN_BRACKETS.search(column)
    is_index = _INDEX.search(column)
    if inside and not is_index and (is_unit(inside[1]) or not _WORD.search(inside[1])):
        return column[: inside.start()], canonical(inside[1]), ''
    if inside:  # as (raw): words like the others
        return column.translate(str.maketrans('[]()', '    ')), '', ''
    words = _WORD.findall(column)
    for count in (3, 2, 1):
        said = LAST.get('_'.join(words[-count:]).lower(), '')
        if said and len(words) > count:
            return ' '.join(words[:-count]), said, ''
    if said := next((word.lower() for word in words if word.lower() in ANYWHERE), ''):
        rest = ' '.join(word for word in words if word.lower() not in ANYWHERE)
        return rest, canonical(said), ''
    letter = words[-1] if re.search(r'[^\W_]+[_ .][msNVA]$', column) else ''
    return ' '.join(words[:-1]) if letter else column, '', letter


def _quantity(words: Sequence[str], unit: str, letter: str) -> str:
    meant = {MEANING[word] for word in words if word in MEANING}
    said = next((name for name in WORDS if name in meant), '')
    if said == 'position' and unit and not fits_quantity(unit, said):
        said = ''  # as of 'angle state [rad/s]'
    unit = unit or letter
    if said or not unit or not is_unit(unit):
        return said
    symbol = next((SYMBOLS[word] for word in words if word in SYMBOLS), '')
    if symbol and fits_quantity(unit, symbol):
        return symbol
    return next((q for q in BY_UNIT if unit not in ('%', '1') and fits_quantity(unit, q)), '')
