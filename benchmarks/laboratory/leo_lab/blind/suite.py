# SPDX-License-Identifier: Apache-2.0
"""The whole benchmark as one file: which cases it has, what it is of, and when it is closed."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from datetime import datetime, UTC
import fcntl
import itertools
from math import gcd
from pathlib import Path
from typing import NamedTuple

from leo_lab.blind.case import ROBOTS
from leo_lab.blind.run_cases import Task
from leo_lab.blind.seeds import check_seeds
from leo_lab.origin import commit
from leo_lab.result_lines import append_result, read_results
from leo_msgs_py.errors import UserError
from leo_msgs_py.terminal import leo

CASES: dict[str | None, dict[str, int]] = {
    None: {
        'effect': 400,
        'none': 400,
        'pair': 150,
        'outside': 60,
        'small': 160,
        'pushed': 60,
        'strength': 320,
        'fault': 160,
        'sound': 80,
    },
    'xl330_pendulum': {'effect': 100, 'none': 100, 'pair': 40},
    'leo': {'effect': 150, 'none': 150, 'pair': 60, 'outside': 30, 'small': 20},
}
"""How many of each kind, on the robots of `case.ROBOTS` in turn and on others."""
PARTS: dict[str, str | None] = {'fixed': None, 'xl330_pendulum': 'xl330_pendulum', 'leo': 'leo'}
GOLDEN = 0.618


class Suite(NamedTuple):
    """What a suite is; the first line of its file.

    Attributes:
        first_seed: of every kind.
        share: of `CASES`.
        examination: its seeds are looked into only when it is closed.
        part: the robots of `PARTS` that it is of; '' for all.
        commit: of the code that runs it.
    """

    first_seed: int
    share: float
    examination: bool
    part: str
    commit: str

    def tasks(self) -> list[Task]:
        """Its cases, mixed: any beginning of them holds the same share of every kind."""
        placed = [
            ((turn + 0.5) / len(seeds), Task(kind, seed, robot))
            for robot, counts in CASES.items()
            if not self.part or PARTS[self.part] == robot
            for kind, count in counts.items()
            for seeds in [_seeds(self.first_seed, count, self.share)]
            for turn, seed in enumerate(seeds)
        ]
        return [task for _, task in sorted(placed, key=lambda item: item[0])]


def _seeds(first: int, count: int, share: float) -> list[int]:
    """That share of `count` seeds, with robots, engines and laws well mixed from the start.

    These take turns from seed to seed with periods up to 40, so the seeds are gone through by
    steps of about a golden section.
    """
    step = next(s for s in itertools.count(round(GOLDEN * count)) if gcd(s, count) == 1)
    return [first + turn * step % count for turn in range(max(1, round(count * share)))]


def begin(results: Path, wanted: Suite, any_commit: bool = False) -> None:
    """Write what a suite is into its file, or see that the file is of that suite.

    Args:
        results: the file.
        wanted: the suite.
        any_commit: lines of other code, and of code that is in no commit, may stand beside.

    Raises:
        UserError: the file is of something else; or seeds on the wrong side.
    """
    check_seeds('the suite', [t.seed for t in wanted.tasks()], [], wanted.examination)
    found = read_suite(results)
    if found is None and results.exists():
        raise UserError(f'leo blind: {results} is no suite; give another -o')
    if found and found[:4] != wanted[:4]:
        raise UserError(f'leo blind: {results} is another suite ({_told(found)}); give another -o')
    if not any_commit:
        _check_commit(results, wanted, found or wanted)
    if found is None:
        append_result(results, {'suite': wanted._asdict()})


def _check_commit(results: Path, wanted: Suite, found: Suite) -> None:
    """Refuse other code than the lines are of, and code that is in no commit for an examination.

    Raises:
        UserError: one of these.
    """
    if wanted.commit != found.commit:
        raise UserError(
            f'leo blind: {results} is of commit {found.commit}, this code is '
            f'{wanted.commit}; check that one out, or --any-commit'
        )
    if wanted.examination and wanted.commit.endswith('+dirty'):
        raise UserError(
            'leo blind: an examination is of a commit, and this tree has changes; '
            'commit them, or --any-commit'
        )


@contextmanager
def alone(results: Path) -> Iterator[None]:
    """Add to a suite while nobody else does; no case is run twice.

    Raises:
        UserError: somebody else does.
    """
    with results.open('a') as stream:
        try:
            fcntl.flock(stream, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except BlockingIOError as error:
            raise UserError(f'leo blind: another run adds to {results}; wait for it') from error
        yield


def read_suite(results: Path) -> Suite | None:
    """What the suite in a results file is; None where it holds none."""
    heads = [line['suite'] for line in read_results(results) if 'suite' in line]
    return Suite(**heads[0]) if heads else None


def missing(results: Path, suite: Suite) -> list[Task]:
    """The cases of a suite that its file has no line of."""
    lines = [line for line in read_results(results) if 'kind' in line]
    done = {(line['kind'], line['seed'], robot_of(line)) for line in lines}
    return [task for task in suite.tasks() if task not in done]


def robot_of(line: dict) -> str | None:
    """The robot that a line was asked of; None where robots take turns."""
    return line['asked'] if 'asked' in line else None if line['robot'] in ROBOTS else line['robot']


def is_closed(results: Path) -> bool:
    """Whether nothing is added to a suite any more."""
    return any('closed' in line for line in read_results(results))


def close(results: Path) -> int:
    """End a suite, and give how many of its cases have no line.

    Raises:
        UserError: the file holds no suite.
    """
    suite = read_suite(results)
    if suite is None:
        raise UserError(f'leo blind: {results} holds no suite')
    left = len(missing(results, suite))
    if not is_closed(results):
        now = datetime.now(UTC).isoformat(timespec='seconds')
        append_result(results, {'closed': now, 'missing': left})
    return left


def check_readable(results: Path) -> None:
    """Refuse to tell an examination before it is closed.

    Raises:
        UserError: it is open; how many of its cases have a line.
    """
    suite = read_suite(results)
    if suite and suite.examination and not is_closed(results):
        total, left = len(suite.tasks()), len(missing(results, suite))
        raise UserError(
            f'leo blind: {results} is an open examination, {total - left} of {total} '
            'cases; rates are told when it is closed: '
            f'{leo("blind", "--close", results)}'
        )


def here(first_seed: int, share: float, examination: bool, part: str = '') -> Suite:
    """The suite of the code that runs."""
    return Suite(first_seed, share, examination, part, commit())


def _told(suite: Suite) -> str:
    kind = 'examination' if suite.examination else 'development'
    part = f', {suite.part} alone' if suite.part else ''
    return f'{kind} from seed {suite.first_seed}, share {suite.share:g}{part}'
