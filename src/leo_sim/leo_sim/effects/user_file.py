# SPDX-License-Identifier: Apache-2.0
"""A user's own effect, read from a Python file; what fails in it is one line with its place."""
from __future__ import annotations

from collections.abc import Callable
from functools import wraps
import importlib.util
from pathlib import Path
import traceback
from types import ModuleType
from typing import Any

from leo_msgs_py.errors import UserError
from leo_sim.effects.base import Effect, HOOKS, Parameter

REQUIRED = ('name', 'family', 'hook', 'parameters')


def read_effect(path: Path) -> Effect:
    """The one effect that a Python file defines.

    Raises:
        UserError: No such file, it fails, or it does not define exactly one whole effect. The
            effect's law raises it too, in place of whatever goes wrong inside.
    """
    module = _module(path)
    found = [c for c in vars(module).values() if isinstance(c, type)
             and issubclass(c, Effect) and c.__module__ == module.__name__]
    if len(found) != 1:
        raise UserError(f'{path} defines {len(found)} effects; it must define exactly one '
                        'subclass of leo_sim.effects.Effect')
    kind = found[0]
    lacking = [name for name in REQUIRED if not hasattr(kind, name)]
    if lacking:
        raise UserError(f'{path}: {kind.__name__} lacks {", ".join(lacking)}; '
                        'see leo_sim.effects.Effect')
    law = getattr(kind, kind.hook, None)
    if kind.hook not in HOOKS or law in (None, getattr(Effect, kind.hook, None)):
        raise UserError(f'{path}: {kind.__name__} needs a hook of {", ".join(HOOKS)}, and the '
                        f'method of that name; its hook is {kind.hook!r}')
    _check_parameters(path, kind)
    effect: Effect = kind()
    effect.source = str(path.resolve())
    setattr(effect, kind.hook, _told(path, getattr(effect, kind.hook)))
    return effect


def _check_parameters(path: Path, kind: type[Effect]) -> None:
    for p in kind.parameters:
        if not (isinstance(p, Parameter) and p.low <= p.neutral <= p.high and p.low < p.high):
            raise UserError(f'{path}: {kind.__name__}.parameters: {p} is no Parameter(name, unit, '
                            'neutral, low, high) with its neutral value between low and high')
        others = {other.name for other in kind.parameters} - {p.name}
        for told in (p.above, p.times):
            if told and told not in others:
                raise UserError(f'{path}: {kind.__name__}.parameters: {p.name} has above or times '
                                f'{told!r}, which is none of the others')


def _module(path: Path) -> ModuleType:
    spec = importlib.util.spec_from_file_location(path.stem, path)
    if spec is None or spec.loader is None or not path.is_file():
        raise UserError(f'no effect file {path}')
    module = importlib.util.module_from_spec(spec)
    _told(path, spec.loader.exec_module)(module)
    return module


def _told(path: Path, run: Callable[..., Any]) -> Callable[..., Any]:
    """`run` with any error of the user's code as one line: file, line, what."""

    @wraps(run)
    def guarded(*args: Any, **named: Any) -> Any:
        try:
            return run(*args, **named)
        except Exception as error:  # a user's code may raise anything
            raise UserError(f'{path}{_line(path, error)}: {type(error).__name__}: {error}; '
                            'mend the effect') from error

    return guarded


def _line(path: Path, error: Exception) -> str:
    """Where in the file it went wrong, as ' line N'."""
    if isinstance(error, SyntaxError):
        return f' line {error.lineno}'
    frames = traceback.extract_tb(error.__traceback__)
    lines = [f.lineno for f in frames if Path(f.filename).resolve() == path.resolve()]
    return f' line {lines[-1]}' if lines else ''
