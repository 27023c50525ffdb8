# SPDX-License-Identifier: Apache-2.0
"""The file of a found effect: what `leo explain --write-effect` writes and `leo add` takes.

What is not this program's own is in it as a literal (`repr`).
"""

from __future__ import annotations

import numpy as np

from leo_diffmodel.explain.unknown.found_effect import FoundEffect
from leo_sim.effects import Parameter

HEADER = '''# Written by leo explain --write-effect.
"""A law found by leo explain; q is the joint angle [rad], dq its rate [rad/s]."""
from typing import Any

import numpy as np

from leo_sim.effects.base import Effect, Parameter, Values


class Found(Effect):
    """The law that explains what was missing."""

    name = {name!r}
    family = 'found'
    hook = {hook!r}
    parameters = (
{parameters}
    )
    equation = {equation!r}
    looks_like = {looks_like!r}
'''
TORQUE = '''
    def torque(
        self, p: Values, q: Any, dq: Any, motor: Any, load: Any{memory}
    ) -> Any:
        """Torque at the joint [N m]."""
        x = {x}
{names}
        y = {law}
        return {result}
'''
COMMAND = '''
    def command(self, p: Values, u: Any, memory: Any, dt: Any) -> tuple[Any, Any]:
        """What the motor gets, as if the torque came from it."""
        x = u
{names}
        y = {law}
        return u + y * {per_torque!r}, memory
'''
TIMED = '''
    def remember(self, p: Values, q: Any, dq: Any, memory: Any, dt: Any) -> Any:
        """Time goes on."""
        return memory + dt
'''
PATH = '''
    def remember(self, p: Values, q: Any, dq: Any, memory: Any, dt: Any) -> Any:
        """How far friction has built up, -1 to 1."""
        before, way = (0.0 if memory is None else memory), np.sign(dq)
        return way + (before - way) * np.exp(-np.abs(dq) * dt / p['reach'])
'''
MEMORY = {'time': ', memory: Any = 0.0', 'path': ', memory: Any = None'}
REMEMBERED = {'time': TIMED, 'path': PATH}
SOURCES = {
    'angle': 'q',
    'rate': 'dq',
    'load': 'load',
    'input': 'motor.torque',
    'time': 'memory + 0.0 * q',
    'path': '-memory if memory is not None else 0.0 * q',
}
RESULTS = {
    'torque': 'y + 0.0 * q',
    'friction': 'np.maximum(y, 0.0) + 0.0 * q',
    'drive': 'y * motor.torque',
}
FLAGS = ('dry', 'motor_side', 'uses_load', 'remembers', 'timed')


def text_of(effect: FoundEffect) -> str:
    """The text of the effect file."""
    assert all(p.name.isidentifier() for p in effect.parameters)
    names = '\n'.join(f'        {p.name} = p[{p.name!r}]' for p in effect.parameters)
    head = HEADER.format(
        name=effect.name,
        hook=effect.hook,
        parameters='\n'.join(f'        {_declared(p)},' for p in effect.parameters),
        equation=effect.equation,
        looks_like=effect.looks_like,
    )
    if effect.hook == 'command':
        per_torque = float(effect.per_torque)
        return head + COMMAND.format(names=names, law=effect.text, per_torque=per_torque)
    flags = ''.join(f'    {name} = True\n' for name in FLAGS if getattr(effect, name))
    law = TORQUE.format(
        memory=MEMORY.get(effect.variable, ''),
        x=SOURCES[effect.variable],
        names=names,
        law=effect.text,
        result=RESULTS[effect.carrier],
    )
    return head + flags + law + REMEMBERED.get(effect.variable, '')


def _declared(parameter: Parameter) -> str:
    text = f'Parameter({parameter.name!r}, {parameter.unit!r}'
    if parameter.neutral:
        text += f', neutral={float(parameter.neutral)!r}'
    if np.isfinite(parameter.low):
        text += f', low={float(parameter.low)!r}'
    return text + ')'
