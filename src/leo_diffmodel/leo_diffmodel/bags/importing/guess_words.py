# SPDX-License-Identifier: Apache-2.0
"""Words of column names in English, German and French, without accents and in small letters."""

from __future__ import annotations

import re
import unicodedata

WORDS = {
    what: set(words.split())
    for what, words in {
        'time': 't time timestamp timestamps stamp clock sec secs seconds zeit '
        'zeitstempel temps instant horodatage',
        'supply_voltage': 'supply battery vbat vbus versorgung versorgungs akku batterie '
        'alimentation',
        'acceleration': 'ddq qdd ddot acc accel acceleration beschleunigung',
        'velocity': 'vel velocity velocities speed speeds dq qd qdot dot dtheta dphi rate '
        'omega drehzahl geschwindigkeit vitesse',
        'effort': 'tau torque torques effort efforts force moment kraft couple',
        'voltage': 'voltage volt volts spannung tension',
        'position': 'pos position positions angle angles q theta phi state winkel lage '
        'stellung weg auslenkung',
        'current': 'strom courant current amps',
    }.items()
}
"""Words of each quantity, the more telling ones first."""
SYMBOLS = {
    'x': 'position',
    's': 'position',
    'v': 'velocity',
    'w': 'velocity',
    'n': 'velocity',
    'f': 'effort',
    'm': 'effort',
    'u': 'voltage',
    'i': 'current',
}
"""Letters of formulas: they count where the unit is one of the quantity."""
ANGLES = {'angle', 'angles', 'theta', 'phi', 'dtheta', 'dphi', 'omega', 'winkel', 'drehzahl'}
"""Words of what turns: a unit of lengths beside them is another word."""
GOAL = {
    'action',
    'actions',
    'goal',
    'goals',
    'target',
    'targets',
    'command',
    'commands',
    'commanded',
    'cmd',
    'desired',
    'des',
    'ref',
    'reference',
    'setpoint',
    'soll',
    'sollwert',
    'ziel',
    'vorgabe',
    'consigne',
    'cible',
    'commande',
}
BESIDE = {
    'observation',
    'measured',
    'meas',
    'present',
    'actual',
    'joint',
    'state',
    'ist',
    'istwert',
    'gemessen',
    'mesure',
    'mesuree',
    'gelenk',
    'articulaire',
    'angulaire',
    'angular',
    'dreh',
    'reel',
    'reelle',
    'de',
    'des',
    'du',
    'le',
    'la',
    'der',
    'die',
    'das',
    'am',
}
_PARTS = sorted(
    {
        'soll',
        'ist',
        'ziel',
        'dreh',
        'gelenk',
        'motor',
        'winkel',
        'drehzahl',
        'geschwindigkeit',
        'moment',
        'kraft',
        'spannung',
        'strom',
        'lage',
        'stellung',
        'position',
        'wert',
        'versorgungs',
        'akku',
    },
    key=len,
    reverse=True,
)
_COMPOUND = re.compile(f'(?:{"|".join(_PARTS)})+')
_PART = re.compile('|'.join(_PARTS))
_WORD = re.compile(r'[^\W\d_]+|\d+')
_CAMEL = re.compile(r'(?<=[a-z])(?=[A-Z][a-z])')


def words_of(name: str) -> list[str]:
    """Return the words of a name: jointPos and Sollwinkel have two each."""
    whole = _WORD.findall(_CAMEL.sub('_', name))
    return [part for word in whole for part in _parts(plain(word))]


def plain(word: str) -> str:
    """Return a word in small letters without accents."""
    text = unicodedata.normalize('NFKD', word.lower())
    return ''.join(sign for sign in text if not unicodedata.combining(sign))


def _parts(word: str) -> list[str]:
    """Return the parts of a German compound, and of any other word itself."""
    return _PART.findall(word) if _COMPOUND.fullmatch(word) else [word]
