# SPDX-License-Identifier: Apache-2.0
"""LeRobot data sets (v2 and v3) as tables, read without LeRobot: an episode each.

    meta/info.json                       fps, and what each feature is called and looks like
    data/chunk-000/file-000.parquet      the frames: observation.state, action, timestamp, ...

A file of v3 holds many episodes, one of v2 a single one; the columns are the same. A feature of
several numbers, as `action` with the names [elbow.pos, ...], becomes one column for each:
`action.elbow.pos`; without names `action.0`, `action.1`, ... Pictures and words are left out.

Source: LeRobot's documentation of LeRobotDataset v3.0 (huggingface.co/docs/lerobot).
"""

from collections.abc import Iterator, Mapping, Sequence
import json
from pathlib import Path
from typing import Any

import numpy as np
from pydantic import BaseModel, Field

from leo_msgs_py.errors import UserError
from leo_sim.common.yaml_file import check, read_text, shown

from .arrays_log import WIDEST
from .log_format import Column, LogFormat, Reader, Table
from .parquet_log import by_episode, content_of, EPISODE

_NUMBERS = ('float', 'int', 'uint', 'bool')


class Feature(BaseModel):
    dtype: str
    shape: list[int]
    names: list[Any] | dict[str, Any] | None = None

    def columns(self, name: str) -> list[str]:
        if not self.dtype.startswith(_NUMBERS) or len(self.shape) != 1 or self.shape[0] > WIDEST:
            return []
        width, found = self.shape[0], list(_texts(self.names))
        named = len(set(found)) == len(found) == width
        parts: Sequence[object] = found if named else range(width)
        return [name] if parts == range(1) else [f'{name}.{part}' for part in parts]


def _texts(names: Any) -> Iterator[str]:
    """Yield the names in lists or objects of any depth: [a, b], {motors: [a, b]}, {a: 0, b: 1}."""
    if isinstance(names, dict) and names and all(isinstance(v, int) for v in names.values()):
        yield from sorted(names, key=lambda name: names[name])
    elif isinstance(names, dict | list):
        for inside in names.values() if isinstance(names, dict) else names:
            yield from _texts(inside)
    elif names is not None:
        yield str(names)


class Info(BaseModel):
    codebase_version: str
    fps: float = Field(gt=0, allow_inf_nan=False)
    features: dict[str, Feature]
    robot_type: str | None = None


def is_lerobot(path: Path) -> bool:
    return (path / 'meta/info.json').is_file()


def read_info(folder: Path) -> Info:
    file = folder / 'meta/info.json'
    try:
        content = json.loads(read_text(file))
    except (ValueError, RecursionError):
        raise UserError(f'{file} is not JSON; fetch the data set again') from None
    info = check(content, Info, file)
    if not info.codebase_version.startswith(('v2.', 'v3.')):
        raise UserError(
            f'{file}: codebase_version {shown(info.codebase_version)} is not read '
            'here; convert the data set to v3.0 with LeRobot'
        )
    return info


def read_lerobot(folder: Path, _: LogFormat) -> list[Table]:
    info = read_info(folder)
    files = sorted(folder.glob('data/chunk-*/*.parquet'))
    if not files:
        raise UserError(f'{folder} has no data/chunk-*/*.parquet; fetch the data set whole')
    parts = [_frames(file, info.features) for file in files]
    table = {name: np.concatenate([part[name] for part in parts]) for name in parts[0]}
    return list(by_episode(table, folder))


def _frames(file: Path, features: Mapping[str, Feature]) -> Table:
    every = {name: feature.columns(name) for name, feature in features.items()}
    wanted = {name: columns for name, columns in every.items() if columns}
    frames = content_of(file, list(wanted))
    for name in (*wanted, EPISODE):
        if name not in wanted or name not in frames:
            raise UserError(
                f'{file} or meta/info.json lacks {name}; there are {", ".join(frames)}'
            )
    table: Table = {}
    for name, columns in wanted.items():
        table |= zip(columns, _numbers(frames[name], len(columns), f'{file}, {name}'), strict=True)
    return table


def _numbers(rows: list[Any], width: int, where: str) -> Column:
    lists = [row if isinstance(row, list) else [row] * width for row in rows]
    try:
        return np.array(lists, dtype=float).reshape(len(rows), width).T
    except (ValueError, TypeError, OverflowError):
        raise UserError(f'{where} has not {width} numbers in every frame') from None


LEROBOT = Reader('lerobot', (), read_lerobot, is_lerobot)
