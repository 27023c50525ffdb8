# SPDX-License-Identifier: Apache-2.0
"""A law as an effect at one joint: what it is fitted with, and the text of its effect file.

`leo explain --write-effect` writes the file and `leo add` takes it. What is not this program's own
is in it as a literal (`repr`).
"""

from typing import Any

import numpy as np

from leo_diffmodel.explain.unknown.law import Law
from leo_sim.common.broadcasting import Array, Numbers
from leo_sim.effects import Effect, Parameter
from leo_sim.effects.base import Values
from leo_sim.effects.motor import Motor

KINDS = {'torque': 'torque', 'friction': 'friction', 'drive': 'share of the motor torque'}
"""What a law may be, in words."""
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
REMEMBERED = {
    'time': '''
    def remember(self, p: Values, q: Any, dq: Any, memory: Any, dt: Any) -> Any:
        """Time goes on."""
        return memory + dt
''',
    'path': '''
    def remember(self, p: Values, q: Any, dq: Any, memory: Any, dt: Any) -> Any:
        """How far friction has built up, -1 to 1."""
        before, way = (0.0 if memory is None else memory), np.sign(dq)
        return way + (before - way) * np.exp(-np.abs(dq) * dt / p['reach'])
''',
}
MEMORY = {'time': ', memory: Any = 0.0', 'path': ', memory: Any = None'}
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
FLAGS = ('dry', 'motor_side', 'uses_load', 'remembers', 'timed', 'steady')


class FoundEffect(Effect):
    """A law of one variable, held as numbers and a function.

    `per_torque` is the input that gives 1 N m at the joint [V or N m], for a law of the input.
    """

    family = 'found'

    def __init__(self, law: Law, joint: str, per_torque: float) -> None:
        self.joint, self.per_torque = joint, per_torque
        variable, carrier = law.curve.variable.name, law.curve.carrier
        self.variable, self.carrier = variable, carrier
        self._law, self.text = law.family.law, law.family.text
        self.name = f'found_{variable}_{carrier}'
        self.hook = 'command' if (variable, carrier) == ('input', 'torque') else 'torque'
        self.parameters = law.parameters
        self.equation, self.looks_like = law.words, _about(law, joint)
        self.dry, self.motor_side = carrier == 'friction', carrier == 'drive'
        self.uses_load = variable == 'load'
        self.remembers, self.timed = variable in ('time', 'path'), variable == 'time'
        self.steady = self.timed

    def command(self, p: Values, u: Array, memory: Any, dt: Numbers) -> tuple[Any, Any]:
        """What the motor gets, as if the torque came from it."""
        return u + self._at(p, u) * self.per_torque, memory

    def torque(
        self, p: Values, q: Array, dq: Array, motor: Motor, load: Any, memory: Any = None
    ) -> Any:
        """Torque at the joint [N m]."""
        of = {'angle': q, 'rate': dq, 'load': load, 'input': motor.torque}
        if self.variable == 'time':
            of['time'] = (0.0 if memory is None else memory) + 0.0 * q
        elif self.variable == 'path':
            of['path'] = 0.0 * q if memory is None else -memory
        y = self._at(p, of[self.variable])
        if self.carrier == 'drive':
            return y * motor.torque
        return (np.maximum(y, 0.0) if self.dry else y) + 0.0 * q

    def remember(self, p: Values, q: Array, dq: Array, memory: Any, dt: Numbers) -> Any:
        """The time, or how far friction has built up, -1 to 1."""
        if self.timed:
            return memory + dt
        before, way = (0.0 if memory is None else memory), np.sign(dq)
        return way + (before - way) * np.exp(-np.abs(dq) * dt / p['reach'])

    def _at(self, p: Values, x: Any) -> Any:
        return self._law(x, **{parameter.name: p[parameter.name] for parameter in self.parameters})


def expressible(law: Law, joint: str) -> bool:
    """Whether one effect at the joint can hold the law: it depends on that joint alone."""
    return law.curve.variable.of in ('', joint)


def _about(law: Law, joint: str) -> str:
    """One line: what kind of torque, where, of what."""
    if law.curve.variable.name == 'path':
        return f'A friction at {joint} that follows the path of motion (hysteresis).'
    dry = 'dry ' if law.curve.carrier == 'friction' else ''
    kind, variable = KINDS[law.curve.carrier], law.curve.variable.name
    return f'A {dry}{kind} at {joint} that depends on {variable}.'


def text_of(effect: FoundEffect) -> str:
    assert all(p.name.isidentifier() for p in effect.parameters)
    names = '\n'.join(f'        {p.name} = p[{p.name!r}]' for p in effect.parameters)
    head = HEADER.format(
        name=effect.name,
        hook=effect.hook,
        parameters='\n'.join(f'        {_declared(p)},' for p in effect.parameters),
        equation=effect.equation,
        looks_like=effect.looks_like,
    )
    own = {'names': names, 'law': effect.text}
    if effect.hook == 'command':
        return head + COMMAND.format(per_torque=float(effect.per_torque), **own)
    flags = ''.join(f'    {name} = True\n' for name in FLAGS if getattr(effect, name))
    memory, result = MEMORY.get(effect.variable, ''), RESULTS[effect.carrier]
    law = TORQUE.format(memory=memory, x=SOURCES[effect.variable], result=result, **own)
    return head + flags + law + REMEMBERED.get(effect.variable, '')


def _declared(parameter: Parameter) -> str:
    text = f'Parameter({parameter.name!r}, {parameter.unit!r}'
    if parameter.neutral:
        text += f', neutral={float(parameter.neutral)!r}'
    if np.isfinite(parameter.low):
        text += f', low={float(parameter.low)!r}'
    return text + ')'
