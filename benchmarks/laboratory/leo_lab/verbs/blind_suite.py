# SPDX-License-Identifier: Apache-2.0
"""leo blind --suite: the whole benchmark of one commit, in as many sittings as it takes."""

from __future__ import annotations

import argparse
from pathlib import Path
from typing import TYPE_CHECKING

from leo_lab.verbs import blind_told
from leo_lab.workers import chosen_workers, Workers
from leo_msgs_py.errors import UserError

if TYPE_CHECKING:
    from leo_lab.blind.suite import Suite


def run(arguments: argparse.Namespace, results: Path) -> int:
    """Run what has no line yet; a suite whose cases all have one is closed, and told."""
    from leo_lab.blind import suite

    if not 0 < arguments.share <= 1:
        raise UserError(
            f'leo blind: --share is more than 0 and at most 1, found {arguments.share:g}'
        )
    workers = chosen_workers(arguments, 'leo blind')
    wanted = suite.here(
        arguments.first_seed, arguments.share, arguments.examination, arguments.part
    )
    suite.begin(results, wanted, arguments.any_commit)
    if not suite.is_closed(results):
        with suite.alone(results):
            _add(results, wanted, workers, arguments.any_commit)
    left = len(suite.missing(results, wanted))
    if not left:
        return close(results, arguments.json)
    state = 'was closed' if suite.is_closed(results) else 'is open; the same command goes on'
    print(f'{results} lacks {left} of {len(wanted.tasks())} cases and {state}')
    return 1


def close(results: Path, as_json: bool) -> int:
    """Close a suite and print what it comes to; 1 where cases have no line."""
    from leo_lab.blind import suite

    left = suite.close(results)
    blind_told.tell_file(results, as_json)
    if not as_json:
        print(f'{results} is closed' + (f'; {left} cases have no line' if left else ''))
    return int(left > 0)


def _add(results: Path, wanted: Suite, workers: Workers, any_commit: bool) -> None:
    from leo_lab.blind import suite
    from leo_lab.blind.progress import counted
    from leo_lab.blind.run_cases import answers, tell_error
    from leo_lab.result_lines import append_result

    left, total = suite.missing(results, wanted), len(wanted.tasks())
    rows = answers(left, workers, wanted.examination)
    for row in counted(rows, total - len(left), total, 'leo blind --suite'):
        if not any_commit:
            _check_worker(row, wanted.commit)
        if row.get('of_machine'):
            tell_error(row)
            continue
        append_result(results, row)


def _check_worker(row: dict, commit: str) -> None:
    """Refuse a line of other code, as a worker on another machine may have."""
    if row['commit'] != commit:
        raise UserError(
            f'leo blind: a worker ({row["machine"]}) runs commit {row["commit"]}, '
            f'not {commit}; install that one there, or --any-commit'
        )
