# SPDX-License-Identifier: Apache-2.0
"""Whether names depend on the order of bags, that of candidates, or on every second state.

    python benchmarks/same_answer.py --first-seed 90001 --cases 50 -o out/same_answer.jsonl

Each blind case (one hidden effect, two in every third) is recorded, cut into two recordings, and
explained four times: as it is, with the recordings in the other order, with the candidates tried
in the other order, and with half of the states left out. A case counts where all four name the
same effects at the same places. Cases that are in the results already are not run again.
"""

from __future__ import annotations

import argparse
from collections.abc import Callable, Iterator, Sequence
from dataclasses import replace
from pathlib import Path
import tempfile
from typing import Any
from unittest import mock

from joblib import delayed, Parallel
from rich.progress import track

from leo_diffmodel.bags.recording import Episode, read_bag, Recording
from leo_diffmodel.compare.windows import every
from leo_diffmodel.explain.estimate.smooth import Smooth
from leo_diffmodel.explain.explanation import explain
from leo_diffmodel.explain.problem.hypothesis import Candidate
from leo_lab.blind.case import draw_case
from leo_lab.blind.record import record
from leo_lab.result_lines import append_result, read_results
from leo_sim.model import Model


def halves(recording: Recording) -> list[Recording]:
    """The first and the second half of each episode, as recordings of their own."""
    cuts = [len(e.t) // 2 for e in recording.episodes]
    first = tuple(_part(e, slice(0, n)) for e, n in zip(recording.episodes, cuts, strict=True))
    second = tuple(_part(e, slice(n, None)) for e, n in zip(recording.episodes, cuts, strict=True))
    return [replace(recording, episodes=part) for part in (first, second)]


def _part(episode: Episode, rows: slice) -> Episode:
    fields = ('t', 'q', 'dq', 'inputs', 'enabled')
    return replace(episode, **{name: getattr(episode, name)[rows] for name in fields}, effort=None)


def answer(recordings: Sequence[Recording], model: Model) -> str:
    """The verdict, and the names with their places in alphabetical order."""
    said = explain(recordings, model)
    names = sorted(f'{e["name"]}:{e["where"]}' for e in said.effects)
    return ' '.join([said.verdict, *names])


def _turned(method: Callable[..., Any]) -> Callable[..., Any]:
    """The method of an estimator, with its candidates in the other order."""

    def called(self: Smooth, at: Any, pool: Sequence[Candidate], *rest: Any, **more: Any) -> Any:
        return method(self, at, pool[::-1], *rest, **more)

    return called


def answers(seed: int) -> dict:
    """All four answers of a case, and what was hidden."""
    case = draw_case(seed, 'pair' if seed % 3 == 0 else 'effect')
    with tempfile.TemporaryDirectory() as folder:
        bags = record(case, Path(folder))
        read = [read_bag(bag, case.robot) for bag in bags]
    model, both = Model(case.robot), [half for r in read for half in halves(r)]
    with mock.patch.object(Smooth, 'extended', _turned(Smooth.extended)):
        turned = answer(both, model)
    return {
        'seed': seed,
        'robot': case.robot.name,
        'hidden': [f'{p.effect.name}:{"+".join(p.where)}' for p in case.effects],
        'as it is': answer(both, model),
        'bags turned': answer(both[::-1], model),
        'candidates turned': turned,
        'every second': answer([every(r, 2) for r in both], model),
    }


WAYS = ('bags turned', 'candidates turned', 'every second')


def rows(seeds: Sequence[int], results: Path, jobs: int) -> Iterator[dict]:
    """One row a seed, those in the results first; new ones are written as they come."""
    done = {row['seed']: row for row in read_results(results)}
    yield from (done[s] for s in seeds if s in done)
    todo = [s for s in seeds if s not in done]
    found = Parallel(n_jobs=jobs, return_as='generator_unordered')(map(delayed(answers), todo))
    for row in track(found, total=len(todo), description='cases'):
        append_result(results, row)
        yield row


def main() -> None:
    """Run, print the cases that differ, and count."""
    parser = argparse.ArgumentParser(description=(__doc__ or '').split('\n')[0])
    parser.add_argument('--first-seed', type=int, default=90001)
    parser.add_argument('--cases', type=int, default=50)
    parser.add_argument('--jobs', type=int, default=2)
    parser.add_argument('-o', type=Path, default=Path('out/same_answer.jsonl'))
    given = parser.parse_args()
    seeds = range(given.first_seed, given.first_seed + given.cases)
    same = dict.fromkeys(WAYS, 0)
    names = dict.fromkeys(WAYS, 0)
    for row in rows(seeds, given.o, given.jobs):
        for way in WAYS:
            same[way] += row[way] == row['as it is']
            names[way] += row[way].split()[1:] == row['as it is'].split()[1:]
            if row[way] != row['as it is']:
                print(
                    f'{row["seed"]} {row["robot"]} {"+".join(row["hidden"])}: '
                    f'{row["as it is"]}; {way}: {row[way]}'
                )
    for way in WAYS:
        print(f'{way}: same names {names[way]} of {len(seeds)}, same verdict too {same[way]}')


if __name__ == '__main__':
    main()
