# SPDX-License-Identifier: Apache-2.0
"""Parquet files as tables: columns of numbers, lists of them, structs, and moments in time [s]."""

from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from leo_msgs_py.errors import UserError

from .arrays_log import tables
from .log_format import LogFormat, opened, Reader, Table

EPISODE, FRAME = 'episode_index', 'frame_index'


def read_parquet(log: Path, log_format: LogFormat) -> list[Table]:
    found = tables(log, content_of(log), log_format)
    return [part for table in found for part in by_episode(table, log)]


def content_of(file: Path, columns: Sequence[str] | None = None) -> dict[str, Any]:
    from pyarrow import compute, parquet, types

    with opened(file, 'a parquet file') as path:
        table = parquet.ParquetFile(path).read(columns=columns)
        while any(types.is_struct(field.type) for field in table.schema):
            table = table.flatten()
        found = dict(zip(table.column_names, table.columns, strict=True))
        for name, column in found.items():
            if types.is_timestamp(column.type):
                whole = column.cast('timestamp[ns]').cast('int64')
                found[name] = compute.multiply(whole.cast('float64', safe=False), 1e-9)
        return {name: column.to_pylist() for name, column in found.items()}


def by_episode(table: Table, log: Path) -> Iterator[Table]:
    """Yield the frames of each episode, in order, as a LeRobot data set numbers them, else all."""
    numbers = table.get(EPISODE, np.zeros(len(next(iter(table.values()), ()))))
    if not np.isfinite(numbers).all():
        raise UserError(f'{log}: frames without {EPISODE}; fetch the data set again')
    order = table.get(FRAME, np.arange(len(numbers)))
    for number in np.unique(numbers):
        rows = np.flatnonzero(numbers == number)
        rows = rows[np.argsort(order[rows], kind='stable')]
        if FRAME in table and (np.diff(order[rows]) == 0).any():
            raise UserError(
                f'{log}: episode {number:.0f} has frames with the same {FRAME}; '
                'are they two episodes? Number them anew'
            )
        yield {name: column[rows] for name, column in table.items()}


PARQUET = Reader('parquet', ('parquet', 'pq'), read_parquet)
