# SPDX-License-Identifier: Apache-2.0
"""Several files that are parts of one run, as q.csv, dq.csv and tau.csv: one table of them all.

Columns get the name of their file in front: `dq.elbow`; what names of files have in common is
left out. Files with times are brought to those of the first that has some, by linear interpolation
where they differ; files without go row by row.
"""

from collections.abc import Sequence
from pathlib import Path
import re
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from leo_msgs_py.errors import UserError

from .guess_columns import MEASURED, rising
from .guess_roles import role_of
from .log_format import Column, Table

SAME = 1e-9  # times that differ by less are the same [of a file's unit]


class Part(NamedTuple):
    """One file: its short name, its table, and the column of its time; '' without one."""

    log: Path
    name: str
    table: Table
    time: str

    @property
    def t(self) -> Column:
        return self.table[self.time]

    @property
    def rows(self) -> int:
        return len(next(iter(self.table.values())))

    def at(self, clock: Column, values: Column) -> Column:
        if not self.time or _same(self.t, clock):
            return values
        known = np.isfinite(self.t)
        return np.interp(clock, self.t[known], values[known])

    def columns(self) -> Table:
        """Return its columns but the time, with its name in front; a nameless one has it alone."""
        found = {name: c for name, c in self.table.items() if name != self.time}
        if list(found) == ['0'] or list(found) == [self.name]:
            return dict(zip([self.name], found.values(), strict=True))
        return {f'{self.name}.{name}': c for name, c in found.items()}


def are_parts(logs: Sequence[Path], tables: Sequence[Table]) -> bool:
    """Say whether files are parts of one run: each has and is named as another quantity."""
    named = [role_of(name).quantity for name in short_names(logs)]
    differ = len(logs) > 1 and all(named) and len(set(named)) == len(named)
    found = ({role_of(name).quantity for name in table} for table in tables)
    return differ and all(len(quantities & {*MEASURED, 'voltage'}) < 2 for quantities in found)


def joined(
    logs: Sequence[tuple[Path, Sequence[Table]]], time: str | None = None
) -> tuple[list[Table], str]:
    """Return the joined tables of files, one for each episode, and how they were joined."""
    if len({len(tables) for _, tables in logs}) > 1:
        counts = {log.name: len(tables) for log, tables in logs}
        raise UserError(f'parts of one run differ in their number of episodes: {counts}')
    paths = [log for log, _ in logs]
    names, found = short_names(paths), []
    for episode in zip(*(tables for _, tables in logs), strict=True):
        files = zip(paths, names, episode, strict=True)
        found.append(_one([Part(log, name, t, _time(t, time)) for log, name, t in files]))
    return [table for table, _ in found], found[0][1]


def short_names(logs: Sequence[Path]) -> list[str]:
    """Return the names of files without the words that all have: q_run3, dq_run3: q, dq."""
    stems = [re.split(r'[_\-. ]+', log.stem) for log in logs]
    if len(stems) > 1:
        for end in (0, -1):
            while all(len(words) > 1 for words in stems) and len({w[end] for w in stems}) == 1:
                stems = [words[1:] if end == 0 else words[:-1] for words in stems]
    return ['_'.join(words) for words in stems]


def _time(table: Table, said: str | None) -> str:
    if said is not None and said in table:
        return said
    return rising(table, {name: role_of(name) for name in table})


def _one(parts: Sequence[Part]) -> tuple[Table, str]:
    listed = ', '.join(part.log.name for part in parts)
    timed = [part for part in parts if part.time]
    if not timed:
        _as_many_rows(parts)
        table = {name: c for part in parts for name, c in part.columns().items()}
        return table, f'joined {listed} row by row, as none has a time'
    clock = timed[0]
    _as_many_rows([clock, *(part for part in parts if not part.time)])
    rows = _overlap(clock.t, [part.t for part in timed], listed)
    table = {clock.time: clock.t[rows]}
    for part in parts:
        table |= {name: part.at(clock.t, c)[rows] for name, c in part.columns().items()}
    return table, _how(listed, clock, parts, len(rows))


def _as_many_rows(parts: Sequence[Part]) -> None:
    if len({part.rows for part in parts}) > 1:
        counts = ', '.join(f'{part.log.name} has {part.rows}' for part in parts)
        raise UserError(
            f'parts without a time go row by row, and these differ: {counts} rows; '
            'give each a column of times, or as many rows'
        )


def _overlap(clock: Column, times: Sequence[Column], listed: str) -> NDArray[np.int64]:
    low, high = max(map(np.nanmin, times)), min(map(np.nanmax, times))
    rows = np.flatnonzero((clock >= low - SAME) & (clock <= high + SAME))
    if len(rows) < 2:
        raise UserError(
            f'{listed}: their times do not overlap, the last begins at {low:.6g} and '
            f'the first ends at {high:.6g}; they are no parts of one run'
        )
    return rows


def _same(t: Column, clock: Column) -> bool:
    return t.shape == clock.shape and bool(np.allclose(t, clock, rtol=0.0, atol=SAME))


def _how(listed: str, clock: Part, parts: Sequence[Part], rows: int) -> str:
    moved = ', '.join(p.log.name for p in parts if p.time and not _same(p.t, clock.t))
    plain = ', '.join(p.log.name for p in parts if not p.time)
    notes = [f'joined {listed} by the times of {clock.log.name}']
    if moved:
        notes.append(f'{moved} interpolated')
    if plain:
        notes.append(f'{plain} row by row')
    if rows < clock.rows:
        notes.append(f'{clock.rows - rows} rows left out that not all have')
    return '; '.join(notes)
