# SPDX-License-Identifier: Apache-2.0
"""A user's own effect, read from a Python file; what fails in it is one line with its place."""
from __future__ import annotations

from pathlib import Path

from leo_msgs_py.errors import UserError
from leo_sim.common.user_code import classes_of, guarded, load_file
from leo_sim.effects.base import Effect, HOOKS, Parameter, ROLES

REQUIRED = ('name', 'family', 'hook', 'parameters')


def read_effect(path: Path) -> Effect:
    """The one effect that a Python file defines.

    Raises:
        UserError: No such file, it fails, or it does not define exactly one whole effect. The
            effect's law raises it too, in place of whatever goes wrong inside.
    """
    found = [c for c in classes_of(load_file(path, 'effect')) if issubclass(c, Effect)]
    if len(found) != 1:
        raise UserError(f'{path} defines {len(found)} effects; it must define exactly one '
                        'subclass of leo_sim.effects.Effect')
    kind = found[0]
    lacking = [name for name in REQUIRED if not hasattr(kind, name)]
    if lacking:
        raise UserError(f'{path}: {kind.__name__} lacks {", ".join(lacking)}; '
                        'see leo_sim.effects.Effect')
    if kind.hook not in HOOKS or not _has_law(kind):
        raise UserError(f'{path}: {kind.__name__} needs a hook of {", ".join(HOOKS)}, and the '
                        f'method of that name; its hook is {kind.hook!r}')
    _check_parameters(path, kind)
    effect: Effect = kind()
    effect.source = str(path.resolve())
    setattr(effect, kind.hook, guarded(path, 'effect', getattr(effect, kind.hook)))
    return effect


def _has_law(kind: type[Effect]) -> bool:
    """Whether it has the method of its hook; for a torque, perhaps as a function of numbers."""
    method = getattr(kind, kind.hook, None)
    written = method not in (None, getattr(Effect, kind.hook, None))
    return written or (kind.hook in ('torque', 'command') and kind.law is not None)


def _check_parameters(path: Path, kind: type[Effect]) -> None:
    for p in kind.parameters:
        if not (isinstance(p, Parameter) and p.low <= p.neutral <= p.high and p.low < p.high):
            raise UserError(f'{path}: {kind.__name__}.parameters: {p} is no Parameter(name, unit, '
                            'neutral, low, high) with its neutral value between low and high')
        if p.role not in ('', *ROLES):
            raise UserError(f'{path}: {kind.__name__}.parameters: {p.name} has the role '
                            f'{p.role!r}; there are {", ".join(ROLES)}')
        others = {other.name for other in kind.parameters} - {p.name}
        for told in (p.above, p.times):
            if told and told not in others:
                raise UserError(f'{path}: {kind.__name__}.parameters: {p.name} has above or times '
                                f'{told!r}, which is none of the others')
