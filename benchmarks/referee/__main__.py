# SPDX-License-Identifier: Apache-2.0
"""Real rigs: `leo explain` beside what a person would use, on the same split, on one machine.

    python -m benchmarks.referee                          # every card whose logs are there
    python -m benchmarks.referee emps --data ~/rigs       # one of them
    python -m benchmarks.referee --page                   # write the tables of docs/referee.md

Run it in the project's root. Each contender gets the logs to learn from in a process of its own,
one after the other; its processor time and its held-out error become a line of OUT/referee.jsonl.
What has a line is not run again.
"""

from __future__ import annotations

import argparse
from collections.abc import Sequence
import json
import os
from pathlib import Path
import subprocess
import sys
import time

from benchmarks.referee.card import make_bags, names, read_card, read_rig, Rig
from benchmarks.referee.contenders import CONTENDERS, Fitted
from benchmarks.referee.page import write_page
from benchmarks.referee.score import held_out_errors, judged, ratio
from benchmarks.rig import DATA
import numpy as np

from leo_lab.origin import origin
from leo_lab.result_lines import append_result, read_results
from leo_msgs_py.errors import UserError

FIT, ERROR = '--fit', 'referee: error: '


def main(argv: list[str]) -> int:
    """Run what has no line yet, or write the page."""
    if argv[:1] == [FIT]:
        return _fit(*argv[1:])
    options = _parser().parse_args(argv)
    if options.page:
        return write_page()
    results = options.output / 'referee.jsonl'
    for name in options.cards or names():
        _card(name, options, results)
    return 0


def _card(name: str, options: argparse.Namespace, results: Path) -> None:
    card, folder = read_card(name), options.output / name
    try:
        make_bags(card, [*options.data, DATA], folder)
    except UserError as error:
        if options.cards:
            raise
        print(f'{name}: left out; {error}', flush=True)
        return
    done = {line['contender'] for line in read_results(results) if line['card'] == name}
    for contender in [c for c in options.contenders or CONTENDERS if c not in done]:
        print(f'{name}: {CONTENDERS[contender][0]}', flush=True)
        line = _timed(name, contender, folder, options.within)
        append_result(results, {'card': name, 'contender': contender, **line, **origin()})


def _timed(name: str, contender: str, folder: Path, within: float) -> dict:
    """The line of a contender: its answer, its error, seconds by the clock and of processor."""
    command = [sys.executable, '-m', 'benchmarks.referee', FIT, name, contender, str(folder)]
    began, before = time.monotonic(), os.times()
    try:
        done = subprocess.run(command, capture_output=True, text=True, timeout=within)
    except subprocess.TimeoutExpired:
        return {'refused': f'no answer in {within:.0f} s'}
    used = os.times()
    spent = used.children_user + used.children_system
    spent -= before.children_user + before.children_system
    seconds = {'seconds': time.monotonic() - began, 'cpu': spent}
    if done.returncode:
        said = (done.stderr.strip().splitlines() or ['no word'])[-1]
        return {'refused': said.removeprefix(ERROR), **seconds}
    return {**json.loads(done.stdout.splitlines()[-1]), **seconds}


def _fit(name: str, contender: str, folder: str) -> int:
    """Fit and score in this process; prints the line as JSON."""
    rig = read_rig(name, Path(folder))
    fitted = CONTENDERS[contender][1](rig)
    errors = held_out_errors(rig, fitted.model)
    np.save(Path(folder) / f'{contender}.npy', errors)
    print(json.dumps(_line(rig, fitted, errors, _of_leo(Path(folder), errors))))
    return 0


def _of_leo(folder: Path, errors: np.ndarray) -> list[float] | None:
    """How many times the error of `leo explain`, and the interval; None before it has run."""
    theirs = folder / 'leo.npy'
    return list(ratio(errors, np.load(theirs))) if theirs.exists() else None


def _line(rig: Rig, fitted: Fitted, errors: np.ndarray, of_leo: Sequence[float] | None) -> dict:
    named = None
    if fitted.named is not None:
        named = {'named': fitted.named, **judged(rig.card.right, rig.card.allowed, fitted.named)}
    law = fitted.with_law and float(np.median(held_out_errors(rig, fitted.with_law)))
    return {
        'error': float(np.median(errors)),
        'error_with_law': law,
        'rms': float(np.sqrt((errors**2).mean())),
        'windows': len(errors),
        'of_leo': of_leo,
        'said': fitted.said,
        'verdict': fitted.verdict,
        **(named or {}),
    }


def _parser() -> argparse.ArgumentParser:
    parser = argparse.ArgumentParser(
        prog='python -m benchmarks.referee',
        description=__doc__,
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    parser.add_argument('cards', nargs='*', metavar='CARD', help=f'of {", ".join(names())}')
    parser.add_argument(
        '--data',
        type=Path,
        nargs='+',
        default=[],
        metavar='DIR',
        help="where the rigs' folders are, besides ../shared/data",
    )
    parser.add_argument('--contenders', nargs='+', choices=CONTENDERS, help='only these')
    parser.add_argument('--within', type=float, default=1800.0, metavar='S', help='for each')
    parser.add_argument('--page', action='store_true', help='write docs/referee.md')
    parser.add_argument('-o', dest='output', type=Path, default=Path('out/referee'))
    return parser


if __name__ == '__main__':
    try:
        sys.exit(main(sys.argv[1:]))
    except UserError as error:
        print(f'{ERROR}{error}', file=sys.stderr)
        sys.exit(2)
