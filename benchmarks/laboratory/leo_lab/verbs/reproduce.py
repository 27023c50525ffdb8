# SPDX-License-Identifier: Apache-2.0
"""`leo reproduce`: redo the thesis' tables and figures."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from functools import partial
import json
from pathlib import Path
import threading
from typing import Any, TYPE_CHECKING

from leo_lab.verbs import reproduce_table7
from leo_lab.workers import add_worker_arguments, chosen_workers
from leo_msgs_py.errors import UserError
from leo_msgs_py.terminal import leo
from leo_msgs_py.verbs.common import dispatch, Parser

if TYPE_CHECKING:
    from leo_lab.thesis.catalogue import Experiment

EXAMPLES = """\
  leo reproduce walk            LEO learns to walk, ten seeds
  leo reproduce walk --seeds 3  the first three of them
  leo reproduce table3 --plan   what is left to run, and how long that takes
  leo reproduce table7          the pendulum whose mass is not the model's
  leo reproduce all --jobs 2    everything that has not been run yet"""
LOOK_PERIOD = 5.0
"""How often the progress of the runs is looked at [s]."""
NAMES = ('walk', 'real', 'table3', 'table6', 'literal', 'ablation', 'rows', 'all')

FIGURES = {
    **dict.fromkeys(('fig7', 'fig8'), 'table3'),
    **dict.fromkeys(('fig12', 'fig13', 'fig14', 'fig15'), 'table7'),
    **dict.fromkeys(('fig16', 'fig17', 'fig18', 'fig19'), 'table6'),
}
"""The thesis' figures by the experiment whose page has them."""


def main(argv: list[str]) -> int:
    """Run the cases that are not in the results file yet, print and write what they come to."""
    verbs: dict[str, Callable[[list[str]], int]] = {
        name: partial(_experiment, name) for name in NAMES
    }
    verbs['table7'] = reproduce_table7.main
    verbs |= {figure: verbs[name] for figure, name in FIGURES.items()}
    return dispatch(
        'leo reproduce', 'Redo tables and figures of the thesis.', verbs, argv, EXAMPLES
    )


def _parser(name: str) -> Parser:
    typed = leo('reproduce', name)
    parser = Parser(
        typed,
        'Train what is not in the results file yet, write the page.',
        f'  {typed} --jobs 2\n  {typed} --plan',
    )
    parser.add_argument('--plan', action='store_true', help='say what is left to run, run nothing')
    parser.add_argument('--seeds', type=int, metavar='N', help='the first N of each kind of case')
    add_worker_arguments(parser, jobs=1)
    parser.add_argument(
        '--folder',
        type=Path,
        default=Path('runs', 'leo'),
        metavar='DIR',
        help='of the training runs; those that were stopped go on',
    )
    parser.add_argument(
        '--results',
        type=Path,
        default=Path('benchmarks', 'results'),
        metavar='DIR',
        help='of the lines of the cases; those found there are not run again',
    )
    parser.add_argument(
        '--page',
        type=Path,
        default=Path('docs', 'leo_results.md'),
        metavar='FILE',
        help='results page, figures beside it',
    )
    return parser


def _experiment(name: str, argv: list[str]) -> int:
    options = _parser(name).parse_args(argv)
    _check(options)

    from leo_lab.result_lines import read_results
    from leo_lab.thesis.cases import missing
    from leo_lab.thesis.catalogue import EXPERIMENTS
    from leo_lab.thesis.page import write_page

    named = EXPERIMENTS.values() if name == 'all' else [EXPERIMENTS[name]]
    chosen = [each.first(options.seeds) for each in named]
    if not options.json:
        _announce(chosen, options)
    if not options.plan:
        for each in chosen:
            _run(each, options)
        write_page(options.page, options.results)
        if name == 'all':
            reproduce_table7.redo(options.results, options.folder, options.page)
    told: list[dict[str, Any]] = [
        {
            'title': each.title,
            'cases': len(each.cases),
            'left': len(missing(each.cases, options.results / each.kind.file)),
            'rows': read_results(options.results / each.kind.file),
        }
        for each in chosen
    ]
    if options.json:
        print(json.dumps(told))
    else:
        for each, answer in zip(chosen, told, strict=True):
            print(f'\n{each.title}\n{each.kind.table(each.cases, answer["rows"])}')
        if not options.plan:
            print(f'page: {options.page}')
    return 0


def _check(options: Any) -> None:
    chosen_workers(options, 'leo reproduce')
    if options.seeds is not None and options.seeds < 1:
        raise UserError('leo reproduce: --seeds takes 1 or more')
    for name, path in (('--results', options.results), ('--folder', options.folder)):
        if path.is_file():
            raise UserError(f'leo reproduce: {name} {path} is a file; give a folder')


def _announce(chosen: list[Experiment], options: Any) -> None:
    """Say what is left to run and how long it will take."""
    from leo_lab.thesis.cases import hours, missing
    from leo_lab.thesis.catalogue import training_hours

    total = 0.0
    for each in chosen:
        path = options.results / each.kind.file
        time = hours(each.cases, path, options.jobs, each.kind.seconds)
        time += training_hours(each, options.results, options.folder, options.jobs)
        total += time
        print(
            f'{each.title}: {len(missing(each.cases, path))} of {len(each.cases)} cases to run, '
            f'about {time:.1f} h'
        )
    print(f'about {total:.1f} h in all with {options.jobs} at once; lines in {options.results}')


def _run(experiment: Experiment, options: Any) -> None:
    from rich.progress import Progress

    from leo_lab.thesis.cases import missing, run_cases
    from leo_msgs_py.console import Terminal

    kind, path = experiment.kind, options.results / experiment.kind.file
    left = missing(experiment.cases, path)
    run = partial(kind.run, folder=options.folder)
    with Progress(console=Terminal(stderr=True), disable=options.json) as progress:
        task = progress.add_task(experiment.title, total=sum(map(kind.seconds, left)))

        def look() -> None:
            done = (kind.seconds(case) * kind.share(case, options.folder) for case in left)
            progress.update(task, completed=sum(done))

        with _every(LOOK_PERIOD, look):
            for row in run_cases(left, run, path, chosen_workers(options, 'leo reproduce')):
                progress.console.print(
                    f'{experiment.title}: seed {row["seed"]}, {row["seconds"] / 60:.0f} min'
                )


@contextmanager
def _every(period: float, call: Callable[[], None]) -> Iterator[None]:
    """Call something every `period` s meanwhile, from a thread of its own."""
    ended = threading.Event()

    def repeat() -> None:
        while not ended.wait(period):
            call()

    thread = threading.Thread(target=repeat)
    thread.start()
    try:
        yield
    finally:
        ended.set()
        thread.join()
