# SPDX-License-Identifier: Apache-2.0
"""`leo seeds`: the same `leo learn` with many seeds, by processes or by a Dask cluster."""

from __future__ import annotations

from collections.abc import Sequence
from contextlib import redirect_stdout
from dataclasses import dataclass
from functools import partial
import io
import json
import math
from pathlib import Path
import shlex
import statistics
from typing import Any

from leo_lab.blind.progress import counted
from leo_lab.result_lines import append_result, read_results, Row
from leo_lab.thesis.cases import found, missing, run_cases
from leo_lab.workers import add_worker_arguments, chosen_workers
from leo_learner.verbs import learn
from leo_msgs_py.errors import UserError
from leo_msgs_py.terminal import leo
from leo_msgs_py.verbs.common import Parser

EXAMPLES = """\
  leo seeds --count 10 --jobs 2 -o runs/many -- --robot pendulum --steps 5000
  leo seeds --scheduler tcp://HOST:8786 -o DIR -- --model repaired/model.yaml"""
LINES = 'seeds.jsonl'
OURS = ('seed', 'output', 'resume', 'on_robot', 'json')
"""Options of `leo learn` that are not to be given."""


@dataclass(frozen=True)
class Case:
    """One run: the words of `leo learn` without seed and folder, and the seed."""

    learn: str
    seed: int


def main(argv: list[str]) -> int:
    """Train the seeds that have no line yet and print their test returns."""
    options = _parser().parse_args(argv)
    cases, results = _cases(options), options.output / LINES
    workers = chosen_workers(options, 'leo seeds')
    _check_same(cases[0], results)
    done, total = len(cases) - len(missing(cases, results)), len(cases)
    run = partial(_trained, folder=options.output.resolve())
    for _ in counted(run_cases(cases, run, results, workers), done, total, 'leo seeds'):
        pass
    lines = read_results(results)
    rows = [row for case in cases if (row := found(case, lines))]
    print(json.dumps(_summary(rows)) if options.json else _told(rows, results))
    return 0


def _parser() -> Parser:
    about = 'Train with many seeds; what is done is kept, and the same command goes on.'
    parser = Parser('leo seeds', about, EXAMPLES)
    parser.add_argument('--count', type=int, default=10, metavar='N', help='seeds (10)')
    parser.add_argument('--first-seed', type=int, default=0, metavar='S')
    parser.add_argument(
        '-o', dest='output', type=Path, required=True, metavar='DIR', help='of the runs'
    )
    add_worker_arguments(parser, jobs=1)
    parser.add_argument('words', nargs='*', metavar='-- OPTIONS', help='of leo learn')
    return parser


def _cases(options: Any) -> list[Case]:
    """A case of each seed; UserError: options that are wrong."""
    if options.count < 1 or options.first_seed < 0:
        raise UserError('leo seeds: --count takes 1 or more, and --first-seed 0 or more')
    if options.output.is_file():
        raise UserError(f'leo seeds: -o {options.output} is a file; give a folder')
    given = learn.command_line().parse_args(options.words)
    for name in OURS:
        if getattr(given, name) not in (None, False):
            option = name.replace('_', '-')
            raise UserError(f'leo seeds: --{option} of leo learn cannot be given; leave it out')
    words = shlex.join(options.words)
    return [Case(words, options.first_seed + turn) for turn in range(options.count)]


def _check_same(case: Case, results: Path) -> None:
    """Write down what is trained before it is, or refuse a folder of something else."""
    lines = read_results(results)
    if not lines:
        append_result(results, {'learn': case.learn})
    elif lines[0].get('learn') != case.learn:
        other = leo('learn', *shlex.split(lines[0].get('learn', '')))
        raise UserError(f'leo seeds: {results} is of {other}; give another -o')


def _trained(case: Case, folder: Path) -> Row:
    """The line of a seed; a run that was stopped goes on.

    Raises:
        KeyboardInterrupt: it was stopped again.
    """
    run, told = folder / f'seed_{case.seed}', io.StringIO()
    words: Sequence[str] = ['--resume', str(run)]
    if not (run / learn.RUN).exists():
        words = [*shlex.split(case.learn), '--seed', str(case.seed), '-o', str(run)]
    with redirect_stdout(told):
        status = learn.main([*words, '--json'])
    if status:
        raise KeyboardInterrupt
    return {**vars(case), **json.loads(told.getvalue())}


def _summary(rows: Sequence[Row]) -> dict[str, Any]:
    """Of the test returns; None for one of a run that diverged, the least of all."""
    returns = [_value(row) for row in rows]
    figures = {'median': statistics.median(returns), 'least': min(returns), 'best': max(returns)}
    told = {name: x if math.isfinite(x) else None for name, x in figures.items()}
    return {'n': len(rows), **told, 'rows': list(rows)}


def _value(row: Row) -> float:
    return -math.inf if row['test_return'] is None else row['test_return']


def _told(rows: Sequence[Row], results: Path) -> str:
    returns, best = [_value(row) for row in rows], max(rows, key=_value)
    each = [f'seed {r["seed"]}: {_value(r):.1f}, {r["seconds"]:.0f} s' for r in rows]
    figures = (
        f'mean test return of {len(rows)} seeds: median {statistics.median(returns):.1f}, '
        f'least {min(returns):.1f}, best {max(returns):.1f}; lines in {results}'
    )
    play = leo('play', best['policy'], '--model', best['model'])
    return '\n'.join([*each, figures, f'next: {play}'])
