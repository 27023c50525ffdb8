# SPDX-License-Identifier: Apache-2.0
"""leo explain: which physical effect is missing, how large, how sure."""

from __future__ import annotations

import argparse
import json
from pathlib import Path

from rich.console import Console
from rich.table import Table

from leo_diffmodel.explain.explanation import explain, Explanation
from leo_diffmodel.verbs import common

EXAMPLES = (
    'leo explain bags/run1 --model pendulum -o out/explain',
    'leo explain bags/run1 --hold-out bags/run2 --model pendulum --json',
    'leo explain bags/run1 --model pendulum --effect my_effect.py',
)
SHOWN = 8


def main(argv: list[str]) -> int:
    """Run `leo explain`; exit status 0 for fine and named, 1 for an open answer."""
    arguments = _parser().parse_args(argv)
    folder = common.fresh_folder(arguments.output)
    model = common.load(arguments)
    recordings, held = common.read_all(arguments, model)
    own = common.own_effects(arguments)
    with common.progress('explaining', common.search_steps(model)) as told:
        result = explain(recordings, model, held, own, told, arguments.step)
    if folder:
        write(folder, result, [*recordings, *held])
    if arguments.json:
        print(json.dumps(result.to_json()))
    else:
        show(result)
        _point_on(arguments, folder, result)
    return 1 if result.verdict in common.NEGATIVE else 0


def write(folder: Path, result: Explanation, recordings: list) -> None:
    """Write explain.json and report.html."""
    from leo_diffmodel.report.explained import write_explanation

    common.write_json(folder, 'explain.json', result.to_json())
    write_explanation(folder / 'report.html', result, recordings)


def show(result: Explanation) -> None:
    """Print the verdict and the leading hypotheses."""
    console = Console()
    console.print(f'[bold]{result.verdict}[/bold]: {result.sentence}', highlight=False)
    if result.hypotheses:
        table = Table(title='hypotheses, best first')
        for column in ('effect', 'parameters', 'gain train / held out [nats]'):
            table.add_column(column)
        for row in result.hypotheses[:SHOWN]:
            table.add_row(f'{row["name"]}:{row["where"]}', _values(row), _gains(row))
        console.print(table)
    if result.next_run:
        console.print(f'what would settle it: {result.next_run}', highlight=False)


def _parser() -> argparse.ArgumentParser:
    arguments = common.parser('explain', __doc__ or '', EXAMPLES)
    common.add_bag_arguments(arguments)
    arguments.add_argument('-o', dest='output', metavar='DIR', help='write JSON and report here')
    return arguments


def _values(row: dict) -> str:
    return ', '.join(f'{n} = {p["value"]:.4g} {p["unit"]}' for n, p in row['parameters'].items())


def _gains(row: dict) -> str:
    held = row['gain_held_out']
    return f'{row["gain_train"]:.1f} / {"-" if held is None else f"{held:.1f}"}'


def _point_on(arguments: argparse.Namespace, folder: Path | None, result: Explanation) -> None:
    if folder:
        print(f'wrote {folder}/explain.json and report.html')
    if folder and result.effects:
        print(f'next: leo add {arguments.model} --from {folder}/explain.json -o repaired.yaml')
