# SPDX-License-Identifier: Apache-2.0
"""An effect file of a law: what `leo add` takes, and what the law is fitted with."""

from __future__ import annotations

import numpy as np

from leo_diffmodel.explain.unknown.law import Law
from leo_sim.effects import Effect, Parameter

ABOUT = {
    'torque': 'torque',
    'friction': 'dry friction',
    'drive': 'share of the motor torque',
}
HEADER = '''"""{about}

{formula}
Found by leo explain; q is the joint angle [rad], dq its rate [rad/s].
"""
from typing import Any

import numpy as np

from leo_sim.effects.base import Effect, Parameter, Values


class Found(Effect):
    """{about}"""

    name = {name!r}
    family = 'found'
    hook = {hook!r}
    parameters = (
{parameters}
    )
    looks_like = {about!r}
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
SOURCES = {'angle': 'q', 'rate': 'dq', 'load': 'load', 'time': 'memory + 0.0 * q'}
RESULTS = {
    'torque': 'y + 0.0 * q',
    'friction': 'np.maximum(y, 0.0) + 0.0 * q',
    'drive': 'y * motor.torque',
}


def expressible(law: Law, joint: str) -> bool:
    """Whether one effect at the joint can hold the law: it depends on that joint alone."""
    return law.curve.variable.of in ('', joint)


def write(law: Law, joint: str, per_torque: float) -> str:
    """The text of the effect file.

    Args:
        law: the law.
        joint: where it acts.
        per_torque: input that gives 1 N m there [V or N m], for a law of the input.
    """
    variable, carrier = law.curve.variable, law.curve.carrier
    command = variable.name == 'input' and carrier == 'torque'
    hook = 'command' if command else 'torque'
    head = HEADER.format(
        about=about(law, joint),
        formula=law.words,
        name=f'found_{variable.name}_{carrier}',
        hook=hook,
        parameters='\n'.join(f'        {_declared(p)},' for p in law.parameters),
    )
    names = '\n'.join(f"        {p.name} = p['{p.name}']" for p in law.parameters)
    if command:
        body = COMMAND.format(names=names, law=law.family.text, per_torque=per_torque)
        return '# Written by leo explain --write-effect.\n' + head + body
    return '# Written by leo explain --write-effect.\n' + head + _flags(law) + _torque(law, names)


def about(law: Law, joint: str) -> str:
    """One line: what kind of torque, where, of what."""
    variable = law.curve.variable
    of = f' of {variable.of}' if variable.of and variable.of != joint else ''
    if variable.name == 'path':
        return f'A friction at {joint} that follows the path of motion (hysteresis).'
    return f'A {ABOUT[law.curve.carrier]} at {joint} that depends on {variable.name}{of}.'


def compiled(text: str) -> Effect:
    """The effect that a file with this text defines."""
    space: dict = {'__name__': 'found'}
    exec(compile(text, 'found effect', 'exec'), space)  # our own text, written above
    effect: Effect = space['Found']()
    return effect


def _flags(law: Law) -> str:
    lines = {
        'dry': law.curve.carrier == 'friction',
        'motor_side': law.curve.carrier == 'drive',
        'uses_load': law.curve.variable.name == 'load',
        'remembers': law.curve.variable.name in ('time', 'path'),
        'timed': law.curve.variable.name == 'time',
    }
    return ''.join(f'    {name} = True\n' for name, on in lines.items() if on)


def _torque(law: Law, names: str) -> str:
    variable = law.curve.variable
    x = SOURCES.get(variable.name, 'memory')
    if variable.name == 'path':
        x = '-memory if memory is not None else 0.0 * q'
    if variable.name == 'input':
        x = 'motor.torque'
    memory = {'time': ', memory: Any = 0.0', 'path': ', memory: Any = None'}
    text = TORQUE.format(
        memory=memory.get(variable.name, ''), x=x, names=names, law=law.family.text,
        result=RESULTS[law.curve.carrier],
    )  # fmt: skip
    if variable.name == 'time':
        return text + TIMED
    if variable.name == 'path':
        return text + PATH
    return text


def _declared(parameter: Parameter) -> str:
    text = f'Parameter({parameter.name!r}, {parameter.unit!r}'
    if parameter.neutral:
        text += f', neutral={float(parameter.neutral)!r}'
    if np.isfinite(parameter.low):
        text += f', low={float(parameter.low)!r}'
    return text + ')'
