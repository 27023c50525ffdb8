# SPDX-License-Identifier: Apache-2.0
"""Does the run that `leo next` proposes settle an ambiguous answer better than a random run?

    python benchmarks/next_run.py --cases 30 --first-seed 52000 -o out/next
    python benchmarks/next_run.py --cases 30 --blind out/blind/results.jsonl -o out/next

Seeds are tried in order, first those (if given) whose longer bag `leo blind` found ambiguous: a
robot with one hidden effect (as in `leo blind`) records a first bag of 8 s. Where its explanation
is `ambiguous`, the robot records the run that `leo next` proposes and, starting anew, a random
run of the same length; each is explained together with the first bag. Counted is how often the
hidden effect is then named, alone or with what is the same thing in the data. A proposal that
says no run of the menu helps counts as not named. Results are one line a seed in next_run.jsonl;
the same command again goes on where it stopped.
"""

from __future__ import annotations

import argparse
from collections.abc import Iterator, Sequence
from dataclasses import replace
import itertools
from pathlib import Path
import tempfile

from joblib import delayed, Parallel
import numpy as np
from rich.console import Console
from rich.progress import Progress
from rich.table import Table

from leo_diffmodel.bags.recording import read_bag, Recording
from leo_diffmodel.explain.explanation import explain
from leo_diffmodel.next_run.proposal import propose
from leo_lab.blind.case import Case, draw_case, ROBOTS
from leo_lab.blind.excitation import excitation
from leo_lab.blind.judge import judge
from leo_lab.blind.record import record
from leo_lab.blind.run_cases import read_lines
from leo_lab.blind.scenes import Given
from leo_lab.blind.table import wilson
from leo_lab.blind.truth import hide, reveal
from leo_lab.result_lines import append_result, read_results
from leo_sim.description.robot import Robot
from leo_sim.model import Model

FIRST_SECONDS = 8.0
NEXT_SECONDS = 20.0
OTHER_NOISE = 1_000_000
KINDS = ('proposed', 'random')


def run_seed(seed: int) -> dict:
    """One line of the results; without the two kinds where the first answer is not ambiguous."""
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        case = shortened(draw_case(seed, 'effect'), FIRST_SECONDS)
        hide(case, folder / 'truth.sealed')
        first = recorded(case, folder / 'first')
        model = Model(case.robot)
        answer = explain([first], model).to_json()
        row = {'seed': seed, 'robot': case.robot.name, 'verdict': answer['verdict']}
        if answer['verdict'] != 'ambiguous':
            return row
        found = propose([first], model, answer, seconds=NEXT_SECONDS)
        row |= {'open': [*found.points, *found.hopeless], 'run': None, 'nats': None}
        runs = {'random': random_run(case.robot, seed)}
        if found.best:
            run, shape = found.best.run, found.best.run.inputs.shape
            row |= {'run': run.name, 'nats': found.best.worth[0]}
            enabled = np.broadcast_to(run.enabled[:, None], shape)
            runs['proposed'] = Given(run.inputs, enabled)
        for kind, scene in runs.items():
            driven = replace(case.run, scenes=(scene,))
            again = replace(case, seed=seed + OTHER_NOISE, run=driven)
            both = [first, recorded(again, folder / kind)]
            answer = explain(both, model).to_json()
            row[kind] = outcome(answer, folder / 'truth.sealed', case.robot)
        return row


def outcome(answer: dict, truth: Path, robot: Robot) -> dict:
    """Whether the hidden effect is named, and what was."""
    judged = judge(reveal(truth), answer, robot)
    named = answer['verdict'] == 'named' and judged['right']
    return {'named': bool(named), **{k: judged[k] for k in ('verdict', 'set', 'right')}}


def random_run(robot: Robot, seed: int) -> Given:
    """Inputs drawn as those of the first bag were."""
    inputs, enabled = excitation(robot, np.random.default_rng([seed, 7]))
    count = round(NEXT_SECONDS / robot.control_period)
    return Given(inputs[:count], enabled[:count])


def shortened(case: Case, seconds: float) -> Case:
    """The case with only the first seconds of its inputs."""
    count = round(seconds / case.robot.control_period)
    (whole,) = case.run.scenes
    assert isinstance(whole, Given)
    first = Given(whole.inputs[:count], whole.enabled[:count])
    return replace(case, run=replace(case.run, scenes=(first,)))


def recorded(case: Case, folder: Path) -> Recording:
    """The bag of a case, read back."""
    (bag,) = record(case, folder)
    return read_bag(bag, case.robot)


def is_open(row: dict) -> bool:
    """Whether a seed counts."""
    return 'random' in row


def seeds(
    given: Sequence[int], first: int, robots: Sequence[str], known: dict[int, dict]
) -> Iterator[int]:
    """Seeds of these robots that have not been run yet, the given ones first."""
    for seed in itertools.chain(given, itertools.count(first)):
        if seed not in known and ROBOTS[seed // 2 % len(ROBOTS)] in robots:
            yield seed


def likely(results: Path) -> list[int]:
    """Seeds of single effects that `leo blind` found ambiguous."""
    rows = (r for r in read_lines(results) if r['kind'] == 'effect')
    return [r['seed'] for r in rows if r['verdict'] == 'ambiguous']


def collect(options: argparse.Namespace, results: Path) -> list[dict]:
    """Run seeds until enough of them are ambiguous; returns those, in order."""
    rows = read_results(results)
    given = likely(options.blind) if options.blind else []
    known = {r['seed']: r for r in rows if r['seed'] >= options.first_seed or r['seed'] in given}
    todo = seeds(given, options.first_seed, options.robots, known.copy())
    with Progress() as bar, Parallel(n_jobs=options.jobs) as pool:
        task = bar.add_task('ambiguous cases', total=options.cases)
        while (count := sum(map(is_open, known.values()))) < options.cases:
            bar.update(task, completed=count, description=f'ambiguous cases of {len(known)}')
            for row in pool(delayed(run_seed)(next(todo)) for _ in range(options.jobs)):
                known[row['seed']] = row
                append_result(results, row)
    found = [known[s] for s in sorted(known) if is_open(known[s])]
    return found[: options.cases]


def show(rows: Sequence[dict]) -> None:
    """Naming rates with their intervals, and each case."""
    console = Console()
    table = Table('seed', 'robot', 'open', 'run', 'nats', *KINDS)
    for row in rows:
        cells = [
            'named' if _named(row, kind) else row.get(kind, {}).get('verdict', 'no proposal')
            for kind in KINDS
        ]
        nats = '-' if row['nats'] is None else f'{row["nats"]:.1f}'
        table.add_row(
            str(row['seed']), row['robot'], '\n'.join(row['open']), row['run'] or '-', nats, *cells
        )
    console.print(table)
    for kind in KINDS:
        hits = sum(_named(row, kind) for row in rows)
        low, high = wilson(hits, len(rows))
        console.print(
            f'{kind}: named in {hits} of {len(rows)} ({100 * hits / len(rows):.0f} %; 95 %: '
            f'{100 * low:.0f} to {100 * high:.0f} %)',
            highlight=False,
        )


def _named(row: dict, kind: str) -> bool:
    return bool(row.get(kind, {}).get('named', False))


def main() -> None:
    """Parse, run what is missing, print."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument('--cases', type=int, default=30, help='ambiguous cases wanted')
    parser.add_argument('--first-seed', type=int, default=52000)
    parser.add_argument('--blind', type=Path, metavar='RESULTS', help='results.jsonl of leo blind')
    parser.add_argument('--robots', nargs='+', choices=ROBOTS, default=ROBOTS)
    parser.add_argument('--jobs', type=int, default=2, help='processes')
    parser.add_argument('-o', dest='output', type=Path, default=Path('out/next'))
    options = parser.parse_args()
    if options.blind and not options.blind.exists():
        parser.error(f'there is no file {options.blind}')
    show(collect(options, options.output / 'next_run.jsonl'))


if __name__ == '__main__':
    main()
