# SPDX-License-Identifier: Apache-2.0
"""Where a line of results comes from: code, machine and packages."""

from __future__ import annotations

from functools import cache
from importlib.metadata import PackageNotFoundError, version
import os
from pathlib import Path
import platform
import subprocess

PACKAGES = ('leo_diffmodel', 'numpy', 'scipy', 'numba', 'joblib', 'torch', 'pybullet', 'mujoco')
CPU_INFO = Path('/proc/cpuinfo')


def origin() -> dict:
    """What a line says of its origin."""
    return {'commit': commit(), 'machine': machine(), 'versions': versions()}


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
