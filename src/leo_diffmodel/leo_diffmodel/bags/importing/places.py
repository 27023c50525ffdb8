# SPDX-License-Identifier: Apache-2.0
"""Places inside a JSON or MATLAB log: `run.data[0]`, `Y[*][1]`, `data[:, 2]`."""

from __future__ import annotations

from pathlib import Path
import re
from typing import Any

import numpy as np

from leo_msgs_py.errors import UserError

_STEP = re.compile(r'[^.\[\]]+|\[\d+\]|\[\*\]|\[\s*:\s*,\s*\d+\s*\]|\[\s*\d+\s*,\s*:\s*\]')


def steps(place: str) -> list[str]:
    """Return the steps on the way to a place: `run`, `data`, `[0]`."""
    return _STEP.findall(place)


def follow(content: Any, place: str, log: Path) -> Any:
    """Return what is at a place without `[*]`.

    Raises:
        UserError: nothing is there; it says what there is.
    """
    value = content
    for step in steps(place):
        try:
            value = into(value, step)
        except (KeyError, IndexError, TypeError, ValueError, OverflowError):
            there = ', '.join(map(str, value)) if isinstance(value, dict) else 'no such part'
            raise UserError(f'{log}: nothing at {place!r}; there is {there}') from None
    return value


def into(value: Any, step: str) -> Any:
    """Return what one step leads to; raises what indexing raises."""
    if not step.startswith('['):
        return value[step]
    if ',' not in step:
        return value[int(step[1:-1])]
    first, second = (part.strip() for part in step[1:-1].split(','))
    matrix = np.asarray(value, dtype=float)
    return matrix[:, int(second)] if first == ':' else matrix[int(first), :]


def expand(content: Any, place: str, log: Path) -> list[Any]:
    """Return what a place with at most one `[*]` leads to, one item per episode.

    Raises:
        UserError: nothing is there, or no list where `[*]` stands.
    """
    before, star, after = place.partition('[*]')
    value = follow(content, before, log)
    if star and not isinstance(value, list | np.ndarray):
        raise UserError(f'{log}: nothing to go through at {place!r}, which needs a list there')
    return [follow(item, after, log) for item in value] if star else [value]
