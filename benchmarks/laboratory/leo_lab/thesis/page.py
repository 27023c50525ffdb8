# SPDX-License-Identifier: Apache-2.0
"""The results page: every experiment that has lines, its table and its figure."""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence
from pathlib import Path

from leo_lab.result_lines import read_results, Row
from leo_lab.thesis.cases import found
from leo_lab.thesis.catalogue import EXPERIMENTS
from leo_msgs_py.terminal import leo
from leo_msgs_py.whole_file import write_whole

ABOUT = """\
# LEO learns to walk: results

Written by `leo reproduce`; every run is one line in `{results}`. A test is one episode from
the nominal start without noise on the scheme the policy is trained on; the best policy of a run
is the one with the best test. Distances, footsteps and energy are of that policy on the reference
scheme, from the nominal start and from ten random ones (nothing is left out: seeds that do not
walk are in every mean). Return: mean and 95 % interval over the seeds (Student's t). Curves: each
seed, the mean over them, and its 95 % band where there are three or more.
"""


def write_page(path: Path, results: Path) -> None:
    """The page of all experiments with lines in the folder `results`, its figures beside it."""
    parts = [ABOUT.format(results=results).rstrip()]
    for name, experiment in EXPERIMENTS.items():
        rows = read_results(results / experiment.kind.file)
        done = [case for case in experiment.cases if found(case, rows)]
        if not done:
            continue
        figure = path.with_name(f'{path.stem}_{name}.png')
        experiment.kind.figure(experiment.title, done, rows, figure)
        parts += [
            f'## {experiment.title}',
            f'`{leo("reproduce", name)}`: {len(done)} of {len(experiment.cases)} cases are in: '
            f'{_commits([line for case in done if (line := found(case, rows))])}',
            experiment.kind.table(done, rows),
            *filter(None, [experiment.thesis]),
            f'![{experiment.title}]({figure.name})',
        ]
    write_whole(path, '\n\n'.join(parts) + '\n')


def _commits(lines: Sequence[Row]) -> str:
    """Of which code lines are, where they tell it."""
    told = Counter(line.get('commit', 'earlier code') for line in lines)
    return ', '.join(f'{count} of {commit}' for commit, count in sorted(told.items()))
