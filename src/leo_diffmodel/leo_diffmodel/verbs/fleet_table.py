# SPDX-License-Identifier: Apache-2.0
"""The table of a fleet: robots as rows, what differs as columns, as many as there is room for."""

from collections import Counter
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any

from rich.table import Column

from leo_diffmodel.fleet.outliers import Figure
from leo_diffmodel.verbs.common import NEGATIVE
from leo_msgs_py.console import figures, listed, Table, Terminal

LISTED = 6  # bags of an open answer that are named


def show(answers: Mapping[str, dict], rows: Sequence[dict], folder: Path | None) -> None:
    """Print the verdicts, the table, and a line for each value that stands out."""
    console = Terminal()
    for line in _verdicts(answers):
        console.print(line, highlight=False)
    if rows:
        console.print(_table(rows))
    for line in _outliers(rows):
        console.print(line, highlight=False)
    if folder:
        console.print(f'wrote {folder}/fleet.json, and a folder for each bag', highlight=False)


def _verdicts(answers: Mapping[str, dict]) -> Iterator[str]:
    counts = Counter(answer['verdict'] for answer in answers.values())
    yield f'{len(answers)} bags: ' + ', '.join(f'{n} {v}' for v, n in counts.most_common())
    for verdict in sorted(NEGATIVE & {*counts}):
        names = [name for name, answer in answers.items() if answer['verdict'] == verdict]
        yield f'{verdict}: {listed(names, LISTED)}'


def _table(rows: Sequence[dict]) -> Table:
    """Robots that stand out in most come first, and what most of them stand out in."""
    far = Counter(name for row in rows for name in row['stand_out'])
    names = sorted({name: None for row in rows for name in row['robots']}, key=lambda n: -far[n])
    table = Table('bag', *map(_head, rows), title='the fleet; * stands out', spare=len(rows) - 1)
    table.add_row('median', *(f'{row["median"]:.4g}' for row in rows), end_section=True)
    for name in names:
        table.add_row(name, *(_cell(row, name) for row in rows))
    return table


def _head(row: dict) -> Column:
    unit = f'{row["parameter"]} [{row["unit"]}]'.strip().replace(' []', '')
    return figures(f'{row["what"]}\n{unit}')[0]


def _cell(row: dict, name: str) -> str:
    robot = row['robots'].get(name)
    if robot is None:
        return ''
    star = '* ' * (name in row['stand_out'])
    return f'{star}{robot["value"]:.4g} {_interval(robot)}'


def _interval(robot: dict[str, Any]) -> str:
    return '[{:.4g}, {:.4g}]'.format(*robot['ci95']) if robot['ci95'] else 'not named'


def _outliers(rows: Sequence[dict]) -> Iterator[str]:
    for row in rows:
        figure = Figure(row['what'], row['parameter'])
        for name in row['stand_out']:
            robot, median = row['robots'][name], f'{row["median"]:.4g} {row["unit"]}'.strip()
            yield (
                f'{name} stands out: {figure} {robot["value"]:.4g} {_interval(robot)}, '
                f'the median of {len(row["robots"])} is {median}'
            )
