# SPDX-License-Identifier: Apache-2.0
"""What a column of a log probably is, by the words of its name."""

from __future__ import annotations

import re
from typing import NamedTuple

WORDS = {
    'time': {'t', 'time', 'timestamp', 'timestamps', 'stamp', 'clock', 'sec', 'secs', 'seconds'},
    'velocity': {'vel', 'velocity', 'speed', 'dq', 'qd', 'qdot', 'dtheta', 'rate', 'omega'},
    'effort': {'tau', 'torque', 'effort'},
    'voltage': {'voltage', 'volt', 'volts'},
    'position': {'pos', 'position', 'angle', 'q', 'theta', 'phi', 'state'},
}
"""Words of each quantity, the more telling ones first."""
GOAL = {
    'action', 'goal', 'target', 'command', 'commanded', 'cmd', 'desired', 'des', 'ref',
    'reference', 'setpoint',
}  # fmt: skip
BESIDE = {'observation', 'measured', 'meas', 'present', 'actual', 'joint', 'state'}
UNITS = {
    'deg': 'deg', 'degree': 'deg', 'degrees': 'deg', 'rad': 'rad', 'radians': 'rad', 'ms': 'ms',
    'us': 'us', 'ns': 'ns', 'rpm': 'rpm', 'nm': 'N m', 'mv': 'mV',
}  # fmt: skip
_IN_BRACKETS = re.compile(r'[\[(]\s*([^\])]*?)\s*[\])]\s*$')
_WORD = re.compile(r'[^\W\d_]+|\d+')


class Role(NamedTuple):
    """What a column is.

    Attributes:
        quantity: a key of `WORDS`; '' for what its name does not say.
        is_goal: whether it was asked for, and not measured.
        joint: the rest of its name; '' without one.
        unit: that the name says, as written there; '' without one.
    """

    quantity: str
    is_goal: bool
    joint: str
    unit: str


def role_of(column: str) -> Role:
    """Return what the words of a column's name say; a goal of nothing is one of a position."""
    unit = _IN_BRACKETS.search(column)
    words = [word.lower() for word in _WORD.findall(_IN_BRACKETS.sub('', column))]
    told = unit[1] if unit else next((UNITS[word] for word in words if word in UNITS), '')
    is_goal = bool(GOAL & set(words))
    quantity = next((name for name, known in WORDS.items() if known & set(words)), '')
    if is_goal and not quantity:
        quantity = 'position'
    return Role(quantity, is_goal, _joint(words), UNITS.get(told, told))


def _joint(words: list[str]) -> str:
    """Return the words that say no quantity, joined."""
    spent = set().union(*WORDS.values(), GOAL, BESIDE, UNITS)
    rest = '_'.join(word for word in words if word not in spent)
    return f'joint{rest}' if rest.isdecimal() else rest
