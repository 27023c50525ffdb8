# SPDX-License-Identifier: Apache-2.0
"""How long many blind cases take on several cores, by the seconds that lines of results tell.

    python benchmarks/suite_hours.py benchmarks/results/blind_leo.jsonl --cores 2 32 200

Cases are drawn from the lines, one for each, and each free core takes the next: nothing is
simulated but who waits. The seconds of a line are those of `leo explain`; drawing and recording
come on top. Prints hours, core hours and the share of them that cores were busy.
"""

from __future__ import annotations

import argparse
import heapq
from pathlib import Path

import numpy as np

from leo_lab.blind.run_cases import read_lines


def main() -> None:
    """Print a line for each number of cores."""
    parser = argparse.ArgumentParser(description=(__doc__ or '').split('\n')[0])
    parser.add_argument('lines', type=Path)
    parser.add_argument('--cases', type=int, default=1000)
    parser.add_argument('--cores', type=int, nargs='+', default=[2, 32, 200])
    parser.add_argument('--seed', type=int, default=0)
    given = parser.parse_args()
    told = np.array([line['seconds'] for line in read_lines(given.lines)])
    drawn = np.random.default_rng(given.seed).choice(told, given.cases)
    print(f'{given.cases} cases, median {np.median(drawn):.0f} s, longest {drawn.max():.0f} s')
    for cores in given.cores:
        end = last_end(drawn, cores)
        print(
            f'{cores} cores: {end / 3600:.2f} h, {cores * end / 3600:.1f} core hours, '
            f'busy {100 * drawn.sum() / (cores * end):.0f} %'
        )


def last_end(seconds: np.ndarray, cores: int) -> float:
    """When the last of some cases ends [s], each begun by the core that is free first."""
    free = [0.0] * cores
    for one in seconds:
        heapq.heapreplace(free, free[0] + float(one))
    return max(free)


if __name__ == '__main__':
    main()
