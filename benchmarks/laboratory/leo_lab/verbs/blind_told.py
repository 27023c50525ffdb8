# SPDX-License-Identifier: Apache-2.0
"""What `leo blind` prints: rates with their intervals, and what was taken for what."""

from __future__ import annotations

from collections.abc import Iterable
import json
from pathlib import Path

from rich.console import Console

from leo_msgs_py.console import Table, Terminal

TITLES = {
    'effect': 'one effect',
    'none': 'no effect',
    'pair': 'two effects',
    'triple': 'three effects',
    'outside': 'outside the catalogue',
    'small': 'many small differences',
    'pushed': 'moved from outside',
    'strength': 'one effect, weak or strong',
    'fault': 'a fault of the log',
    'sound': 'no fault of the log',
}
WORDS = {
    'right': 'right',
    'family': 'right family',
    'exact': 'exactly these',
    'lone': 'named alone and sure',
    'largest_first': 'the largest hidden effect first',
    'both': 'both of two named',
    'seen': 'something is missing',
    'mended': 'the effect beside it is named (--mend)',
    'sure_wrong': 'sure of an effect that is not there',
    'extra': 'with names beyond what is there',
    'small_named_large': 'nothing large, but one named as such',
}
Groups = dict[str, dict[str, list[dict]]]
"""{'fixed base' or a walker: {kind: lines}}"""
FIXED = 'fixed base'


def tell_file(results: Path, as_json: bool) -> None:
    """Print the tables of a results file; nothing runs.

    Raises:
        UserError: an examination that is not closed.
    """
    from leo_lab.blind.run_cases import read_lines
    from leo_lab.blind.suite import check_readable

    check_readable(results)
    tell(grouped(read_lines(results)), as_json)


def grouped(lines: Iterable[dict]) -> Groups:
    """Lines by robots and kind."""
    from leo_lab.blind.suite import robot_of

    groups: Groups = {}
    for line in lines:
        of = groups.setdefault(robot_of(line) or FIXED, {})
        of.setdefault(line['kind'], []).append(line)
    return groups


def tell(groups: Groups, as_json: bool) -> None:
    """Print the tables, or what they are made of; JSON names the robots where there are more."""
    if as_json:
        told = {name: _summaries(answers) for name, answers in groups.items()}
        print(json.dumps(next(iter(told.values())) if len(told) == 1 else told))
        return
    for name, answers in groups.items():
        _tell_kinds('' if len(groups) == 1 else f'{name}: ', answers)


def _summaries(answers: dict[str, list[dict]]) -> dict:
    from leo_lab.blind.table import confusion, summary

    tables = {kind: confusion(rows) for kind, rows in answers.items()}
    first = min((r['seed'] for rows in answers.values() for r in rows), default=None)
    summaries = {kind: summary(kind, rows) for kind, rows in answers.items()}
    return {'first_seed': first, **summaries, 'confusion': tables}


def _tell_kinds(whose: str, answers: dict[str, list[dict]]) -> None:
    from leo_lab.blind.table import summary

    console = Terminal()
    for kind, rows in answers.items():
        seeds = [r['seed'] for r in rows]
        title = f'{whose}{TITLES[kind]}, seeds {min(seeds)} … {max(seeds)}'
        _print_rates(console, title, summary(kind, rows))
        _print_tables(console, rows)


def _print_rates(console: Console, title: str, rates: dict) -> None:
    console.print(f'{title}: {rates["cases"]} bags', highlight=False)
    for share, words in WORDS.items():
        if share in rates:
            console.print(f'  {words}: {_rate(rates[share])}', highlight=False)
    if 'intervals' in rates:
        console.print(
            f'  parameters off by {100 * rates["parameter_error_median"]:.2f} % (median); '
            f'95 % intervals hold the truth: {_rate(rates["intervals"])}',
            highlight=False,
        )
    console.print(
        f'  ambiguous: {100 * rates["ambiguous"]:.1f} %; {rates["seconds_median"]:.1f} s a bag '
        f'(longest {rates["seconds_max"]:.1f} s)',
        highlight=False,
    )


def _rate(rate: dict) -> str:
    low, high = (100 * bound for bound in rate['wilson95'])
    share = '-' if rate['rate'] is None else f'{100 * rate["rate"]:.1f} %'
    return f'{rate["hits"]} of n = {rate["n"]}, {share} (95 %: {low:.1f} to {high:.1f} %)'


def _print_tables(console: Console, rows: list[dict]) -> None:
    from leo_lab.blind.table import by, confusion

    table = Table('hidden', 'bags', 'answers')
    for name, answers in confusion(rows).items():
        text = ', '.join(f'{answer} {count}' for answer, count in answers.items())
        table.add_row(name, str(sum(answers.values())), text)
    console.print(table)
    for key in ('robot', 'engine'):
        shares = (f'{value} {right} of {count}' for value, right, count in by(rows, key))
        console.print(f'  right by {key}: {", ".join(shares)}', highlight=False)
