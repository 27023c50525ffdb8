# SPDX-License-Identifier: Apache-2.0
"""How long `leo explain` takes, from the prompt and back, on 20 s bags of blind cases.

    python benchmarks/explain_speed.py --first-seed 90001 --cases 6

Each case is recorded as `leo blind` does it, one hidden effect, and explained by the command in a
process of its own: start, search, and with `-o` the report too. Run it on a quiet machine.
"""

from __future__ import annotations

import argparse
from collections.abc import Iterator
from itertools import count, islice
from pathlib import Path
from statistics import median
import subprocess
import tempfile
import time

from leo_diffmodel.blind.case import Case, draw_case
from leo_diffmodel.blind.record import record

GATES = {'pendulum': 5.0, 'double_pendulum': 10.0}


def cases(robot: str, first_seed: int) -> Iterator[Case]:
    """Single effects on one robot."""
    return (c for s in count(first_seed) if (c := draw_case(s, 'effect')).robot.name == robot)


def seconds(bag: Path, robot: str, *options: str) -> float:
    """Wall time of one command."""
    began = time.perf_counter()
    command = ['leo', 'explain', str(bag), '--model', robot, *options]
    if subprocess.run(command, capture_output=True).returncode not in (0, 1):
        raise SystemExit(f'{" ".join(command)} failed')
    return time.perf_counter() - began


def main() -> None:
    """Time all and print."""
    parser = argparse.ArgumentParser(description=(__doc__ or '').split('\n')[0])
    parser.add_argument('--first-seed', type=int, default=90001)
    parser.add_argument('--cases', type=int, default=6)
    arguments = parser.parse_args()
    for robot, gate in GATES.items():
        search, report = [], []
        for case in islice(cases(robot, arguments.first_seed), arguments.cases):
            with tempfile.TemporaryDirectory() as folder:
                (bag,) = record(case, Path(folder))
                search.append(seconds(bag, robot))
                report.append(seconds(bag, robot, '-o', f'{folder}/out'))
            name = case.effects[0].effect.name
            print(f'{robot} {case.seed} {name}: {search[-1]:.1f} s, '
                  f'with report {report[-1]:.1f} s', flush=True)
        print(f'{robot}: median {median(search):.1f} s, most {max(search):.1f}; with report '
              f'median {median(report):.1f}, most {max(report):.1f} (gate {gate:g})')


if __name__ == '__main__':
    main()
