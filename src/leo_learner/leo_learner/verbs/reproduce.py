# SPDX-License-Identifier: Apache-2.0
"""`leo reproduce`: redo the thesis' tables and figures."""

from __future__ import annotations

from functools import partial
import json
from pathlib import Path
import threading
from typing import Any

from leo_learner.verbs import reproduce_table7
from leo_msgs_py.errors import UserError
from leo_msgs_py.verbs.common import dispatch, Parser

EXAMPLES = """\
  leo reproduce walk            LEO learns to walk, ten seeds
  leo reproduce table3 --plan   what is left to run, and how long that takes
  leo reproduce table7          the pendulum whose mass is not the model's
  leo reproduce all --jobs 2    everything on LEO that has not been run yet"""
LOOK_PERIOD = 5.0
"""How often the progress of the runs is looked at [s]."""
NAMES = ('walk', 'literal', 'ablation', 'table3', 'real', 'all')


def main(argv: list[str]) -> int:
    """Run the cases that are not in the results file yet, print and write what they come to."""
    verbs = {name: partial(_experiment, name) for name in NAMES}
    return dispatch(
        'leo reproduce', 'Redo tables and figures of the thesis.',
        verbs | {'table7': reproduce_table7.main}, argv, EXAMPLES,
    )


def _parser(name: str) -> Parser:
    parser = Parser(
        f'leo reproduce {name}', 'Train what is not in the results file yet, write the page.',
        f'  leo reproduce {name} --jobs 2\n  leo reproduce {name} --plan',
    )
    parser.add_argument('--plan', action='store_true', help='say what is left to run, run nothing')
    parser.add_argument('--jobs', type=int, default=1, metavar='N', help='processes at once')
    parser.add_argument(
        '--backend', default='loky', help="joblib's: loky (this machine), or one registered"
    )
    parser.add_argument(
        '--folder', type=Path, default=Path('runs', 'leo'), metavar='DIR',
        help='of the training runs; those that were stopped go on',
    )
    parser.add_argument(
        '--results', type=Path, default=Path('benchmarks', 'results', 'leo.jsonl'),
        metavar='FILE', help='one line per case is appended; cases found there are not run again',
    )
    parser.add_argument(
        '--page', type=Path, default=Path('docs', 'leo_results.md'), metavar='FILE',
        help='results page, figures beside it',
    )
    parser.add_json()
    return parser


def _experiment(name: str, argv: list[str]) -> int:
    from leo_learner.experiments.cases import hours, missing, read_results
    from leo_learner.experiments.catalogue import EXPERIMENTS
    from leo_learner.experiments.page import table, write_page
    from leo_learner.experiments.walking import seconds

    options = _parser(name).parse_args(argv)
    if options.jobs < 1:
        raise UserError('leo reproduce: --jobs takes 1 or more')
    chosen = list(EXPERIMENTS.values()) if name == 'all' else [EXPERIMENTS[name]]
    cases = list(dict.fromkeys(case for each in chosen for case in each.cases))
    left = missing(cases, options.results)
    time = hours(cases, options.results, options.jobs, seconds)
    if not options.json:
        print(f'{len(cases)} cases, {len(left)} of them to run: about {time:.1f} h '
              f'with {options.jobs} at once; lines in {options.results}')
    if not options.plan:
        _run(left, options)
        write_page(options.page, options.results, read_results(options.results))
    rows = read_results(options.results)
    if options.json:
        print(json.dumps({'cases': len(cases), 'left': len(missing(cases, options.results)),
                          'hours': time, 'rows': rows}))
    else:
        for each in chosen:
            print(f'\n{each.title}\n{table(each, rows)}')
        print(f'page: {options.page}')
    return 0


def _run(left: list[Any], options: Any) -> None:
    from rich.console import Console
    from rich.progress import Progress

    from leo_learner.experiments.cases import run_cases
    from leo_learner.experiments.walking import run_case, steps_done

    run = partial(run_case, folder=options.folder)
    ended = threading.Event()
    with Progress(console=Console(stderr=True), disable=options.json) as progress:
        task = progress.add_task('transitions', total=sum(case.steps for case in left))

        def watch() -> None:
            while not ended.wait(LOOK_PERIOD):
                done = sum(steps_done(case, options.folder) for case in left)
                progress.update(task, completed=done)

        threading.Thread(target=watch, daemon=True).start()
        try:
            for row in run_cases(left, run, options.results, options.jobs, options.backend):
                progress.console.print(
                    f'{row["robot"]} {row["truth"]} {row["agent"]} {row["actions"]} '
                    f'{row["config"]} seed {row["seed"]}: test return {row["test_return"]:.0f}, '
                    f'{row["nominal"]["distance"]:.2f} m, {row["seconds"] / 60:.0f} min'
                )
        finally:
            ended.set()
