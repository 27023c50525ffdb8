# SPDX-License-Identifier: Apache-2.0
"""Where a line of results comes from, and which seeds an examination may use."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from functools import cache
from importlib.metadata import PackageNotFoundError, version
import os
from pathlib import Path
import platform
import subprocess

from leo_msgs_py.errors import UserError

FIRST_OF_EXAMINATION = 50_000
"""Smaller seeds are for development, these and larger ones for examinations."""
PACKAGES = ('leo_diffmodel', 'numpy', 'scipy', 'numba', 'joblib', 'pybullet', 'mujoco')
CPU_INFO = Path('/proc/cpuinfo')


def check_seeds(
    kind: str, seeds: Sequence[int], held: Iterable[Mapping], examination: bool
) -> None:
    """Refuse a seed on the wrong side, or one that was examined before, by other code.

    What this code examined is not run again, so an examination that was cut off goes on.

    Args:
        kind: of the cases.
        seeds: that are asked for.
        held: lines of the results file.
        examination: whether this is one.

    Raises:
        UserError: one line that says which seed and why.
    """
    if not examination:
        if seeds and max(seeds) >= FIRST_OF_EXAMINATION:
            raise UserError(
                f'leo blind: seed {max(seeds)} is for an examination of {kind}; '
                f'take seeds below {FIRST_OF_EXAMINATION}, or --examination'
            )
        return
    if seeds and min(seeds) < FIRST_OF_EXAMINATION:
        raise UserError(
            f'leo blind: seed {min(seeds)} is for development; an examination '
            f'takes seeds from {FIRST_OF_EXAMINATION} on'
        )
    own = (True, commit())
    before = (x for x in held if x['kind'] == kind and (x['examination'], x['commit']) != own)
    seen = {line['seed'] for line in before} & set(seeds)
    if seen:
        raise UserError(
            f'leo blind: seed {min(seen)} of {kind} is in the results already; '
            'no seed is examined twice'
        )


def stamp(examination: bool) -> dict:
    """What a line says of its origin."""
    return {
        'examination': examination,
        'commit': commit(),
        'machine': machine(),
        'versions': versions(),
    }


@cache
def commit() -> str:
    """`git describe` of the tree that this code lies in, '+dirty' where it was changed."""
    name = _git('describe', '--always', '--tags')
    return f'{name}+dirty' if name and _git('status', '--porcelain') else name or 'unknown'


@cache
def machine() -> str:
    """Processor, cores and system."""
    told = CPU_INFO.read_text().splitlines() if CPU_INFO.exists() else []
    models = [line.split(':', 1)[1].strip() for line in told if line.startswith('model name')]
    processor = models[0] if models else platform.processor()
    kind = ' '.join(filter(None, (platform.machine(), processor)))
    return f'{kind}, {os.cpu_count()} cores, {platform.system()}'


@cache
def versions() -> dict[str, str]:
    """Of Python and the packages that are there."""
    found = {'python': platform.python_version()}
    for package in PACKAGES:
        try:
            found[package] = version(package)
        except PackageNotFoundError:
            continue
    return found


def _git(*words: str) -> str:
    folder = Path(__file__).resolve().parent
    try:
        done = subprocess.run(['git', '-C', folder, *words], capture_output=True, text=True)
    except OSError:
        return ''
    return done.stdout.strip() if done.returncode == 0 else ''
