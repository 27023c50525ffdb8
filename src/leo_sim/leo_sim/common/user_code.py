# SPDX-License-Identifier: Apache-2.0
"""Python files of the user's: loaded, and what fails in them is one line with its place."""

from collections.abc import Callable
from functools import wraps
import importlib.util
from pathlib import Path
import traceback
from types import ModuleType
from typing import Any

from leo_msgs_py.errors import one_line, UserError


def load_file(path: Path, what: str) -> ModuleType:
    """The module that a Python file makes when it runs; UserError, with `what` it is: it fails."""
    spec = importlib.util.spec_from_file_location(path.stem, path)
    if spec is None or spec.loader is None or not path.is_file():
        raise UserError(f'no {what} file {path}')
    module = importlib.util.module_from_spec(spec)
    guarded(path, what, spec.loader.exec_module)(module)
    return module


def classes_of(module: ModuleType) -> list[type]:
    classes = (value for value in vars(module).values() if isinstance(value, type))
    return [kind for kind in classes if kind.__module__ == module.__name__]


def guarded(
    path: Path,
    what: str,
    run: Callable[..., Any],
    meant: tuple[type[Exception], ...] = (UserError,),
    raises: type[Exception] = UserError,
) -> Callable[..., Any]:
    """`run` with any error of the user's code as one line: file, line, what.

    Errors in `meant` pass as they are, any other becomes one of `raises`, whose text says `what`
    the file holds.
    """

    @wraps(run)
    def call(*args: Any, **named: Any) -> Any:
        try:
            return run(*args, **named)
        except meant:
            raise
        except Exception as error:  # a user's code may raise anything
            raise raises(
                f'{path}{_line(path, error)}: {type(error).__name__}: '
                f'{one_line(error)}; mend the {what}'
            ) from error

    return call


def _line(path: Path, error: Exception) -> str:
    if isinstance(error, SyntaxError):
        return f' line {error.lineno}'
    frames = traceback.extract_tb(error.__traceback__)
    lines = [f.lineno for f in frames if Path(f.filename).resolve() == path.resolve()]
    return f' line {lines[-1]}' if lines else ''
