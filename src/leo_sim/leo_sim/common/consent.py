# SPDX-License-Identifier: Apache-2.0
"""Whose Python runs: a file of effects that another file names runs only if the user names it."""

from __future__ import annotations

import argparse
from collections.abc import Iterable
import os
from pathlib import Path
import shlex
from typing import TYPE_CHECKING

from leo_msgs_py.errors import UserError

if TYPE_CHECKING:
    from leo_sim.effects.base import Placed

_trusted: set[Path] = set()


def trust(path: str) -> str:
    """Let this process run an effect file that the user has named; UserError: there is none."""
    if path.endswith('.py') and not os.path.isfile(path):
        raise UserError(f'no effect file {path}')
    _trusted.add(Path(path).resolve())
    return path


def add_effect_argument(
    parser: argparse.ArgumentParser, about: str = 'an effect of yours, which MODEL may name'
) -> None:
    """Accept `--effect FILE.py`, several times; each file may then run."""
    parser.add_argument(
        '--effect', action='append', default=[], type=trust, metavar='FILE.py', help=about
    )


def require(named: Iterable[str], by: str | Path) -> None:
    """See that those of the named effects which are Python files may run.

    UserError: one that the user has not named, and how to; `by` is the file that names it.
    """
    files = [Path(name) for name in named if name.endswith('.py')]
    strange = [file for file in files if os.path.isfile(file) and file.resolve() not in _trusted]
    if strange:
        options = shlex.join(words(strange))
        raise UserError(
            f'{by} would run Python code, {", ".join(map(str, strange))}; if you trust it, add: '
            f'{options} (to a node: {shlex.join(_parameter(strange))})'
        )


def words(files: Iterable[str | Path]) -> list[str]:
    """The options that let files run, as typed in the folder of now: `--effect FILE` for each."""
    return [word for file in files for word in ('--effect', _from_here(file))]


def effect_words(effects: Iterable[Placed]) -> list[str]:
    """The options that a model with these effects needs."""
    return words(effect_files(effects))


def effect_files(effects: Iterable[Placed]) -> list[str]:
    return list(dict.fromkeys(p.effect.source for p in effects if p.effect.source))


def trust_parameter(given: Iterable[str]) -> None:
    """Let the files of a node's parameter `effect` run; empty names count for none."""
    for path in filter(None, given):
        trust(path)


def _parameter(files: Iterable[Path]) -> list[str]:
    names = [_from_here(file) for file in files]
    return ['-p', f'effect:={names[0] if len(names) == 1 else "[" + ", ".join(names) + "]"}']


def _from_here(file: str | Path) -> str:
    path = Path(file).resolve()
    return str(path.relative_to(Path.cwd()) if path.is_relative_to(Path.cwd()) else path)
