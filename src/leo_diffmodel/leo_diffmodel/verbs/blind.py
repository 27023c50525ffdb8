# SPDX-License-Identifier: Apache-2.0
"""leo blind: hide effects in robots by seed, explain their bags, count what was right."""

from __future__ import annotations

import argparse
import json
from pathlib import Path

from rich.console import Console
from rich.table import Table

from leo_diffmodel.verbs import common
from leo_msgs_py.errors import UserError

EXAMPLES = (
    'leo blind --cases 200 --no-effect 200 -o out/blind',
    'leo blind --cases 20 --first-seed 5000 -o out/quick --jobs 1',
)


def main(argv: list[str]) -> int:
    """Run `leo blind`; exit status 0."""
    from leo_diffmodel.blind.run import run

    arguments = _parser().parse_args(argv)
    if min(arguments.cases, arguments.no_effect, arguments.first_seed) < 0:
        raise UserError('leo blind: --cases, --no-effect and --first-seed take 0 or more, found '
                        f'{arguments.cases}, {arguments.no_effect}, {arguments.first_seed}')
    if arguments.jobs < 1:
        raise UserError(f'leo blind: --jobs takes 1 or more, found {arguments.jobs}')
    folder = common.fresh_folder(arguments.output) or Path('out/blind')
    first, results = arguments.first_seed, folder / 'results.jsonl'
    answers = {}
    for kind, count in (('effect', arguments.cases), ('no effect', arguments.no_effect)):
        seeds = range(first, first + count)
        if count:
            answers[kind] = run(seeds, kind == 'effect', results, arguments.jobs)
    _print(answers, first, arguments.json)
    if not arguments.json:
        print(f'wrote {results}; the same command again runs only what is missing')
    return 0


def _parser() -> argparse.ArgumentParser:
    arguments = common.parser('blind', __doc__ or '', EXAMPLES)
    arguments.add_argument('--cases', type=int, default=20, help='bags with one hidden effect')
    arguments.add_argument('--no-effect', type=int, default=20, help='bags without any')
    arguments.add_argument('--first-seed', type=int, default=1)
    arguments.add_argument('--jobs', type=int, default=2, help='processes')
    arguments.add_argument('-o', dest='output', metavar='DIR', help='where results are kept')
    arguments.add_argument('--json', action='store_true', help='print the summary as JSON')
    return arguments


def _print(answers: dict[str, list[dict]], first: int, as_json: bool) -> None:
    from leo_diffmodel.blind.table import by_effect, mistakes, summary

    summaries = {kind: summary(rows) for kind, rows in answers.items()}
    if as_json:
        print(json.dumps({'first_seed': first, **summaries}))
        return
    console = Console()
    for kind, rows in answers.items():
        s = summaries[kind]
        console.print(
            f'{kind}: {s["right"]} of {s["cases"]} right ({100 * s["rate"]:.1f} %, at 95 % '
            f'confidence wrong in at most {100 * s["wrong_at_most"]:.1f} %), ambiguous '
            f'{100 * s["ambiguous"]:.1f} %, {s["seconds_median"]:.1f} s a bag '
            f'(longest {s["seconds_max"]:.1f} s), seeds {first} … {first + len(rows) - 1}',
            highlight=False,
        )
        table = Table('effect', 'right', 'of')
        for name, right, count in by_effect(rows):
            table.add_row(name, str(right), str(count))
        console.print(table)
        for truth, answer, count in mistakes(rows):
            console.print(f'  {truth} taken as {answer}: {count}', highlight=False)
