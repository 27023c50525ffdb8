# SPDX-License-Identifier: Apache-2.0
"""How long `leo explain` and `leo compare` take, from the prompt and back, on 20 s of blind cases.

    python benchmarks/explain_speed.py --first-seed 90001 --cases 6
    python benchmarks/explain_speed.py --robot leo --kind none --cases 4

Each case is recorded as `leo blind` does it, and explained by the command in a process of its own:
start, search, and with `-o` the report too. Run it on a quiet machine.
"""

from __future__ import annotations

import argparse
from collections.abc import Callable, Iterator, Sequence
from itertools import count, islice
from pathlib import Path
from statistics import median
import subprocess
import tempfile
import time

from leo_lab.blind.case import Case, draw_case, KINDS
from leo_lab.blind.record import record

GATES = {'pendulum': 5.0, 'double_pendulum': 10.0, 'leo': 30.0}
WALKERS = ('leo',)


def cases(robot: str, kind: str, first_seed: int) -> Iterator[Case]:
    """Those on one robot."""
    drawn = (draw_case(s, kind, robot if robot in WALKERS else None) for s in count(first_seed))
    return (case for case in drawn if case.robot.name == robot)


def seconds(verb: str, bags: Sequence[Path], robot: str, *options: str) -> float:
    """Wall time of one command."""
    began = time.perf_counter()
    command = ['leo', verb, *map(str, bags), '--model', robot, *options]
    if subprocess.run(command, capture_output=True).returncode not in (0, 1):
        raise SystemExit(f'{" ".join(command)} failed')
    return time.perf_counter() - began


def times(case: Case) -> dict[str, float]:
    """What each command takes on the bags of a case."""
    with tempfile.TemporaryDirectory() as folder:
        bags, robot = record(case, Path(folder)), case.robot.name
        return {
            'compare': seconds('compare', bags, robot),
            'explain': seconds('explain', bags, robot),
            'with report': seconds('explain', bags, robot, '-o', f'{folder}/out'),
        }


def main() -> None:
    """Time all and print."""
    parser = argparse.ArgumentParser(description=(__doc__ or '').split('\n')[0])
    parser.add_argument('--first-seed', type=int, default=90001)
    parser.add_argument('--cases', type=int, default=6)
    parser.add_argument('--kind', choices=[*KINDS], default='effect')
    parser.add_argument('--robot', choices=[*GATES], action='append')
    arguments = parser.parse_args()
    for robot in arguments.robot or ('pendulum', 'double_pendulum'):
        taken = []
        for case in islice(cases(robot, arguments.kind, arguments.first_seed), arguments.cases):
            taken.append(times(case))
            names = '+'.join(p.effect.name for p in case.effects) or 'none'
            print(f'{robot} {case.seed} {names}: {_text(taken[-1])}', flush=True)
        print(
            f'{robot}: median {_text(_over(median, taken))}; most {_text(_over(max, taken))} '
            f'(gate of explain {GATES[robot]:g} s)'
        )


def _over(what: Callable[[list[float]], float], taken: list[dict[str, float]]) -> dict[str, float]:
    return {verb: what([t[verb] for t in taken]) for verb in taken[0]}


def _text(taken: dict[str, float]) -> str:
    return ', '.join(f'{verb} {value:.1f} s' for verb, value in taken.items())


if __name__ == '__main__':
    main()
