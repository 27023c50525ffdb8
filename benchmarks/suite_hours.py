# SPDX-License-Identifier: Apache-2.0
"""How long many blind cases take on several cores, by the seconds that lines of results tell.

    python benchmarks/suite_hours.py FILE.jsonl --cores 2 32 200 --price 0.04

Cases are drawn from the lines, one for each, and each free core takes the next: nothing is
simulated but who waits. The seconds of a line are of the processor, from drawing the case to its
line. Prints hours, core hours, the share of them that cores were busy, and what they cost.
"""

from __future__ import annotations

import argparse
import heapq
from pathlib import Path
import sys

import numpy as np

from leo_lab.blind.run_cases import read_lines


def main() -> None:
    """Print a line for each number of cores."""
    parser = argparse.ArgumentParser(description=(__doc__ or '').split('\n')[0])
    parser.add_argument('lines', type=Path)
    parser.add_argument('--cases', type=int, default=1000)
    parser.add_argument('--cores', type=int, nargs='+', default=[2, 32, 200])
    parser.add_argument('--seed', type=int, default=0)
    parser.add_argument('--price', type=float, help='of a core hour')
    given = parser.parse_args()
    told = [line['cpu_seconds'] for line in read_lines(given.lines) if 'cpu_seconds' in line]
    if not told:
        sys.exit(f'{given.lines}: no line tells its cpu_seconds; give newer lines of `leo blind`')
    drawn = np.random.default_rng(given.seed).choice(told, given.cases)
    print(f'{given.cases} cases, median {np.median(drawn):.0f} s, longest {drawn.max():.0f} s')
    for cores in given.cores:
        end = last_end(drawn, cores)
        hours = cores * end / 3600
        cost = '' if given.price is None else f', costs {given.price * hours:.2f}'
        print(
            f'{cores} cores: {end / 3600:.2f} h, {hours:.1f} core hours, '
            f'busy {100 * drawn.sum() / (cores * end):.0f} %{cost}'
        )


def last_end(seconds: np.ndarray, cores: int) -> float:
    """When the last of some cases ends [s], each begun by the core that is free first."""
    free = [0.0] * cores
    for one in seconds:
        heapq.heapreplace(free, free[0] + float(one))
    return max(free)


if __name__ == '__main__':
    main()
