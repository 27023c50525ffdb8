# SPDX-License-Identifier: Apache-2.0
"""leo blind: hide effects in robots by seed, explain the bags, count what was right."""

from __future__ import annotations

import argparse
from importlib.util import find_spec
import json
from pathlib import Path

from rich.console import Console
from rich.table import Table

from leo_diffmodel.verbs import common
from leo_msgs_py.console import Terminal
from leo_msgs_py.errors import UserError

EXAMPLES = (
    'leo blind --cases 200 --no-effect 200 -o out/blind',
    'leo blind --pairs 100 --outside 40 --first-seed 5000 -o out/blind',
    'leo blind --cases 20 --jobs 1 -o out/quick',
    'leo blind --robot leo --cases 20 --pairs 10 -o out/blind_leo',
    'leo blind --small 24 --pushed 24 -o out/small',
    'leo blind --small 96 --first-seed 50001 --examination -o out/examined',
    'leo blind --table out/small/results.jsonl',
)
AGAIN = '; the same command again runs only what is missing'
OPTIONS = {
    'cases': ('effect', 'bags with one hidden effect'),
    'no_effect': ('none', 'bags without any'),
    'pairs': ('pair', 'bags with two effects, each of 2 noise floors or more'),
    'triples': ('triple', 'bags with three effects, each of 2 noise floors or more'),
    'outside': ('outside', 'bags with a law that is not in the catalogue'),
    'small': ('small', 'bags with 4 to 8 small differences and none, one or two effects'),
    'pushed': ('pushed', 'bags of robots that are shoved, led by a hand or held'),
}
TITLES = {'effect': 'one effect', 'none': 'no effect', 'pair': 'two effects',
          'triple': 'three effects', 'outside': 'outside the catalogue',
          'small': 'many small differences', 'pushed': 'moved from outside'}  # fmt: skip
WORDS = {'right': 'right', 'family': 'right family', 'exact': 'exactly these',
         'lone': 'named alone and sure', 'largest_first': 'the largest hidden effect first',
         'both': 'both of two named', 'sure_wrong': 'sure of an effect that is not there',
         'extra': 'with names beyond what is there',
         'small_named_large': 'nothing large, but one named as such'}  # fmt: skip


def main(argv: list[str]) -> int:
    """Run `leo blind`; exit status 0, 1 where a case has no answer."""
    from leo_diffmodel.blind.run_cases import run

    arguments = _parser().parse_args(argv)
    if arguments.table:
        return _show(arguments.table, arguments.json)
    counts, walker = _counts(arguments), _walker(arguments)
    _check_kinds(counts, walker, arguments.without_mujoco)
    folder = common.fresh_folder(arguments.output) or Path('out/blind')
    first, results = arguments.first_seed, folder / _file(walker)
    asked = {kind: range(first, first + count) for kind, count in counts.items() if count}
    _check_seeds(asked, results, arguments.examination)
    answers = {
        kind: run(seeds, kind, results, arguments.jobs, walker, not arguments.without_mujoco,
                  arguments.examination)
        for kind, seeds in asked.items()
    }  # fmt: skip
    _print({kind: rows for kind, rows in answers.items() if rows}, arguments.json)
    if not arguments.json:
        again = '' if arguments.examination else AGAIN
        print(f'wrote {results}{again}')
    return int(any(len(answers[kind]) < len(seeds) for kind, seeds in asked.items()))


def _check_kinds(counts: dict[str, int], walker: Path | None, without: bool) -> None:
    """Refuse what cannot be simulated here."""
    if counts.get('pushed') and walker:
        raise UserError('leo blind: --pushed takes robots with a fixed base; leave out --robot')
    if counts.get('small') and not without and find_spec('mujoco') is None:
        raise UserError('leo blind: --small simulates every second bag by MuJoCo, which is not '
                        'installed: pip install -r requirements-mujoco.txt, or --without-mujoco')


def _check_seeds(asked: dict[str, range], results: Path, examination: bool) -> None:
    """All kinds before any of them runs."""
    from leo_diffmodel.blind.origin import check_seeds
    from leo_diffmodel.blind.run_cases import read_lines

    for kind, seeds in asked.items():
        check_seeds(kind, seeds, read_lines(results), examination)


def _show(results: Path, as_json: bool) -> int:
    """Print the tables of a results file; nothing runs."""
    from leo_diffmodel.blind.run_cases import read_lines

    if not results.is_file():
        raise UserError(f'leo blind: no results at {results}')
    of: dict[str, list[dict]] = {}
    for line in read_lines(results):
        of.setdefault(line['kind'], []).append(line)
    _print(of, as_json)
    return 0


def _counts(arguments: argparse.Namespace) -> dict[str, int]:
    """Cases of each kind; 20 with an effect and 20 without where nothing is asked for."""
    asked = {name: getattr(arguments, name) for name in OPTIONS}
    for name, value in (*asked.items(), ('first_seed', arguments.first_seed)):
        if value is not None and value < 0:
            option = name.replace('_', '-')
            raise UserError(f'leo blind: --{option} takes 0 or more, found {value}')
    if arguments.jobs < 1:
        raise UserError(f'leo blind: --jobs takes 1 or more, found {arguments.jobs}')
    if all(value is None for value in asked.values()):
        return {'effect': 20, 'none': 20}
    return {OPTIONS[name][0]: value or 0 for name, value in asked.items()}


def _walker(arguments: argparse.Namespace) -> Path | None:
    """The folder of the robot with contacts that was asked for."""
    from leo_sim.description.robot import load_robot
    from leo_sim.task.motions import check_motion, MOTIONS

    if arguments.robot is None:
        return None
    robot = load_robot(arguments.robot)
    if not robot.contacts:
        raise UserError(f'leo blind: --robot takes a walker, and {robot.name} touches no ground; '
                        'without --robot all robots without contact are drawn')  # fmt: skip
    for motion in MOTIONS:
        check_motion(robot, motion)
    return robot.folder.resolve()


def _file(walker: Path | None) -> str:
    """Where the lines are kept: a walker's cases have the seeds of the others'."""
    return f'results_{walker.name}.jsonl' if walker else 'results.jsonl'


def _parser() -> argparse.ArgumentParser:
    arguments = common.parser('blind', __doc__ or '', EXAMPLES)
    for name, (_, about) in OPTIONS.items():
        arguments.add_argument(f'--{name.replace("_", "-")}', type=int, metavar='N', help=about)
    arguments.add_argument('--robot', metavar='R', help='a walker instead, as leo')
    arguments.add_argument('--first-seed', type=int, default=1)
    arguments.add_argument('--examination', action='store_true',
                           help='seeds from 50000 on, none of them twice')
    arguments.add_argument('--without-mujoco', action='store_true',
                           help='small differences by our own integrators alone')
    arguments.add_argument('--table', type=Path, metavar='FILE.jsonl',
                           help='print what a results file says, and run nothing')
    arguments.add_argument('--jobs', type=int, default=2, help='processes')
    arguments.add_argument('-o', dest='output', metavar='DIR', help='where results are kept')
    arguments.add_argument('--json', action='store_true', help='print the summary as JSON')
    return arguments


def _print(answers: dict[str, list[dict]], as_json: bool) -> None:
    from leo_diffmodel.blind.table import confusion, summary

    summaries = {kind: summary(kind, rows) for kind, rows in answers.items()}
    if as_json:
        tables = {kind: confusion(rows) for kind, rows in answers.items()}
        first = min((r['seed'] for rows in answers.values() for r in rows), default=None)
        print(json.dumps({'first_seed': first, **summaries, 'confusion': tables}))
        return
    console = Terminal()
    for kind, rows in answers.items():
        seeds = [r['seed'] for r in rows]
        title = f'{TITLES[kind]}, seeds {min(seeds)} … {max(seeds)}'
        _print_rates(console, title, summaries[kind])
        _print_tables(console, rows)


def _print_rates(console: Console, title: str, rates: dict) -> None:
    console.print(f'{title}: {rates["cases"]} bags', highlight=False)
    for share, words in WORDS.items():
        if share in rates:
            console.print(f'  {words}: {_rate(rates[share])}', highlight=False)
    if 'intervals' in rates:
        console.print(
            f'  parameters off by {100 * rates["parameter_error_median"]:.2f} % (median); '
            f'95 % intervals hold the truth: {_rate(rates["intervals"])}', highlight=False
        )  # fmt: skip
    console.print(
        f'  ambiguous: {100 * rates["ambiguous"]:.1f} %; {rates["seconds_median"]:.1f} s a bag '
        f'(longest {rates["seconds_max"]:.1f} s)', highlight=False
    )  # fmt: skip


def _rate(rate: dict) -> str:
    if 'wilson95' in rate:
        low, high = (100 * bound for bound in rate['wilson95'])
        share = '-' if rate['rate'] is None else f'{100 * rate["rate"]:.1f} %'
        return f'{rate["hits"]} of n = {rate["n"]}, {share} (95 %: {low:.1f} to {high:.1f} %)'
    return (f'{rate["hits"]} = {100 * rate["rate"]:.1f} % (at 95 % confidence '
            f'{100 * rate["at_least"]:.1f} % or more, {100 * rate["at_most"]:.1f} % or less)')


def _print_tables(console: Console, rows: list[dict]) -> None:
    from leo_diffmodel.blind.table import by, confusion

    table = Table('hidden', 'bags', 'answers')
    for name, answers in confusion(rows).items():
        text = ', '.join(f'{answer} {count}' for answer, count in answers.items())
        table.add_row(name, str(sum(answers.values())), text)
    console.print(table)
    for key in ('robot', 'engine'):
        shares = (f'{value} {right} of {count}' for value, right, count in by(rows, key))
        console.print(f'  right by {key}: {", ".join(shares)}', highlight=False)
