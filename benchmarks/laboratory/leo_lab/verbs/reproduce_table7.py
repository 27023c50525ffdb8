# SPDX-License-Identifier: Apache-2.0
"""`leo reproduce table7`: the pendulum whose mass is not the model's."""

from __future__ import annotations

from functools import partial
import json
from pathlib import Path
import statistics
from typing import Any

from leo_lab.workers import add_worker_arguments, chosen_workers, ONE
from leo_msgs_py.console import Table
from leo_msgs_py.errors import UserError
from leo_msgs_py.verbs.common import Parser

EXAMPLES = """\
  leo reproduce table7
  leo reproduce table7 --repair thesis --seeds 1
  leo reproduce table7 --truth mass --repair explain --transitions 1000
  leo reproduce table7 --config thesis --steps 50000"""
GATE = 0.97
"""Share of the gap that has to be closed."""
LINEAR = 1000.0
"""Returns below minus this, as at first, are drawn by their logarithm."""
SETTINGS = ('truth', 'repair', 'transitions', 'config', 'steps', 'more_steps')
"""What sets one group of cases apart from another."""


def main(argv: list[str]) -> int:
    """Run the cases that are not in the results file yet; 1 where the gate is not met."""
    options = _options(argv)
    if options.results.is_dir():
        raise UserError(f'leo reproduce: --results {options.results} is a folder; give a file')
    if min(options.seeds, options.transitions, options.steps, options.more_steps) < 1:
        raise UserError('leo reproduce: --seeds, --transitions, --steps take 1 or more')
    rows = _rows(options)
    result, beside = _summary(rows), _beside(options.results, rows[0])
    drawn = _draw(rows, options.figure)
    if options.json:
        print(json.dumps(result | {'rows': rows, 'beside': beside}))
    else:
        _print(rows, result)
        _print_beside(beside, options.results)
        print(
            f'figure: {options.figure}'
            if drawn
            else 'no figure: lines of an earlier version have no learning curves'
        )
    return 0 if result['share'] >= GATE else 1


def redo(results: Path, folder: Path, page: Path) -> None:
    """The default cases, their lines and curves among those of the experiments on LEO."""
    options = _options(
        [
            '--results',
            str(results / 'table7.jsonl'),
            '--folder',
            str(folder / 'table7'),
            '--figure',
            str(page.with_name('table7.png')),
        ]
    )
    _draw(_rows(options), options.figure)


def _options(argv: list[str]) -> Any:
    options = _parser().parse_args(argv)
    if options.more_steps is None:
        options.more_steps = options.steps // 2
    return options


def _parser() -> Parser:
    parser = Parser('leo reproduce table7', 'Redo Table 7 of the thesis.', EXAMPLES)
    parser.add_argument(
        '--truth',
        choices=['moved', 'mass'],
        default='moved',
        help='mass 0.09 kg with the inertia about the pivot kept, or the mass alone',
    )
    parser.add_argument(
        '--repair',
        choices=['recommended', 'thesis', 'explain'],
        default='recommended',
        help='the difference network, or the effects that leo explain names',
    )
    parser.add_argument('--transitions', type=int, default=5000, metavar='N')
    parser.add_argument('--config', choices=['recommended', 'thesis'], default='recommended')
    parser.add_argument('--steps', type=int, default=10_000, metavar='N', help='of DDPG')
    parser.add_argument(
        '--more-steps', type=int, metavar='N', help='of DDPG after the repair (half of --steps)'
    )
    parser.add_argument('--seeds', type=int, default=5, metavar='N')
    parser.add_argument('--folder', type=Path, default=Path('runs', 'table7'), metavar='DIR')
    parser.add_argument(
        '--results',
        type=Path,
        default=Path('benchmarks', 'results', 'table7.jsonl'),
        metavar='FILE',
        help='one line per case is appended; cases found there are not run again',
    )
    parser.add_argument(
        '--figure',
        type=Path,
        default=Path('docs', 'table7.png'),
        metavar='FILE',
        help='learning curves on the ideal, the repaired and the real pendulum',
    )
    add_worker_arguments(parser, jobs=1)
    return parser


def _draw(rows: list[dict[str, Any]], path: Path) -> bool:
    """The learning curves, as in the thesis' Figures 13 to 15."""
    from leo_lab.thesis.png_figures import learning_curves

    if not all('curves' in row for row in rows):
        return False
    names = {'ideal': 'on the ideal model', 'repaired': 'on the repaired', 'real': 'on the real'}
    groups = {
        text: [{'steps': row['curves'][name][-1][0], 'curve': row['curves'][name]} for row in rows]
        for name, text in names.items()
    }
    title = f'Table 7, {rows[0]["truth"]}, {rows[0]["repair"]}'
    learning_curves(groups, title, path, LINEAR)
    return True


def _rows(options: Any) -> list[dict[str, Any]]:
    """The lines of the cases, from the results file or by running them."""
    from leo_lab.result_lines import read_results
    from leo_lab.thesis.cases import found, run_cases
    from leo_lab.thesis.table7 import Case, run_case

    cases = [
        Case(
            options.truth,
            options.repair,
            options.transitions,
            options.config,
            options.steps,
            options.more_steps,
            seed,
        )
        for seed in range(options.seeds)
    ]

    workers = chosen_workers(options, 'leo reproduce')
    run = partial(run_case, folder=options.folder, quiet=options.json or workers != ONE)
    for _ in run_cases(cases, run, options.results, workers):
        pass
    lines = read_results(options.results)
    return [row for case in cases if (row := found(case, lines)) is not None]


def _summary(rows: list[dict[str, Any]]) -> dict[str, Any]:
    from leo_lab.thesis.table7 import share, shares

    down = [100 * (1 - row['mse_after'] / row['mse_before']) for row in rows]
    each = shares(rows)
    means = {
        f'{key}_mean': statistics.mean(row[key] for row in rows)
        for key in ('mse_before', 'mse_after', 'return_ideal', 'return_repaired', 'return_real')
    }
    return {
        'n': len(rows),
        'share': share(rows),
        'shares': each,
        'share_least': min(each),
        'mse_down_percent': down,
        **means,
    }


def _beside(path: Path, row: dict[str, Any]) -> list[dict[str, Any]]:
    """Summaries of what else the results file has of the same truth, however it was learned."""
    from leo_lab.result_lines import read_results

    groups: dict[tuple[Any, ...], list[dict[str, Any]]] = {}
    for other in read_results(path):
        groups.setdefault(tuple(other[key] for key in SETTINGS), []).append(other)
    own = tuple(row[key] for key in SETTINGS)
    return [
        dict(zip(SETTINGS, key, strict=True)) | _summary(rows)
        for key, rows in groups.items()
        if key != own and key[0] == own[0]
    ]


def _print(rows: list[dict[str, Any]], result: dict[str, Any]) -> None:

    from leo_msgs_py.console import Terminal

    first = rows[0]
    table = Table(title=f'Table 7, {first["truth"]}, {first["repair"]}, n = {result["n"]}')
    heads = ('seed', 'MSE before', 'after', 'down %', 'ideal', 'repaired', 'real', 'share')
    for head in heads:
        table.add_column(head, justify='right')
    for row, down, part in zip(rows, result['mse_down_percent'], result['shares'], strict=True):
        table.add_row(
            str(row['seed']),
            f'{row["mse_before"]:.4g}',
            f'{row["mse_after"]:.3g}',
            f'{down:.4f}',
            *(f'{row[f"return_{k}"]:.0f}' for k in ('ideal', 'repaired', 'real')),
            f'{part:.4f}',
        )
    Terminal().print(table)
    print(
        f'share of the gap closed: {result["share"]:.4f} of the mean returns, least of a seed '
        f'{result["share_least"]:.4f} (gate {GATE})'
    )


def _print_beside(groups: list[dict[str, Any]], path: Path) -> None:
    for group in groups:
        print(
            'beside it: repair {repair} with {transitions} transitions, DDPG {config} with '
            '{steps} + {more_steps} steps, n = {n}: MSE {mse_before_mean:.4g} -> '
            '{mse_after_mean:.3g}; returns ideal {return_ideal_mean:.0f}, repaired '
            '{return_repaired_mean:.0f}, real {return_real_mean:.0f}; share {share:.4f}'.format(
                **group
            )
        )
    print(f'lines in {path}')
