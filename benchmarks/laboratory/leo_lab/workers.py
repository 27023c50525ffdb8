# SPDX-License-Identifier: Apache-2.0
"""Who works for a verb of the laboratory: `--jobs` and `--scheduler`."""

from typing import Any

from leo_diffmodel.fleet.workers import distributed, Workers
from leo_msgs_py.errors import UserError
from leo_msgs_py.verbs.common import Parser

__all__ = ['ONE', 'Workers', 'add_worker_arguments', 'chosen_workers']
ONE = Workers()


def add_worker_arguments(parser: Parser, jobs: int) -> None:
    """Accept `--jobs` and `--scheduler`."""
    parser.add_argument('--jobs', type=int, default=jobs, metavar='N', help='processes at once')
    parser.add_argument(
        '--scheduler',
        metavar='tcp://HOST:PORT',
        help='the workers of a Dask scheduler instead of processes',
    )


def chosen_workers(options: Any, verb: str) -> Workers:
    """What the command line asks for.

    Raises:
        UserError: fewer than one process, or a cluster without the package that talks to it.
    """
    if options.jobs < 1:
        raise UserError(f'{verb}: --jobs takes 1 or more, found {options.jobs}')
    if options.scheduler is not None:
        distributed()
    return Workers(options.jobs, options.scheduler)
