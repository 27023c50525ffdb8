# SPDX-License-Identifier: Apache-2.0
"""How long `read_bag` takes, over the mcap library's own reader on the same bag.

    python benchmarks/reading.py [--seconds 20] [--repeats 9]

A pendulum at 100 Hz, both readers by turns in one process, medians of processor time. The
library's reader yields bytes; ours decodes them, checks them and lays them on one time line.
"""

from __future__ import annotations

import argparse
from collections.abc import Callable
from pathlib import Path
from statistics import median
import tempfile
import time

from mcap.reader import make_reader
import numpy as np

from leo_diffmodel.bags.arrays import Run, write_runs
from leo_diffmodel.bags.recording import read_bag

PERIOD = 0.01


def swing(seconds: float) -> Run:
    """A swing, with a different voltage at every step."""
    t = np.arange(round(seconds / PERIOD), dtype=np.float64) * PERIOD
    voltage = np.random.default_rng(0).normal(size=len(t))
    inputs = {'pivot': {'voltage': voltage, 'enabled': np.ones(len(t))}}
    return Run(t, ['pivot'], np.sin(t)[:, None], np.cos(t)[:, None], inputs=inputs)


def bytes_only(bag: Path) -> None:
    """Every message, as the library yields it."""
    for file in sorted(bag.glob('*.mcap')):
        with file.open('rb') as stream:
            for _ in make_reader(stream).iter_messages():
                pass


def spent(read: Callable[[Path], object], bag: Path) -> float:
    """Processor seconds of one reading."""
    began = time.process_time()
    read(bag)
    return time.process_time() - began


def main() -> None:
    """Time both and print."""
    parser = argparse.ArgumentParser(description=(__doc__ or '').split('\n')[0])
    parser.add_argument('--seconds', type=float, default=20.0)
    parser.add_argument('--repeats', type=int, default=9)
    arguments = parser.parse_args()
    with tempfile.TemporaryDirectory() as folder:
        bag = write_runs(Path(folder) / 'bag', [swing(arguments.seconds)], {})
        turns = [
            (spent(lambda b: read_bag(b, 'pendulum'), bag), spent(bytes_only, bag))
            for _ in range(arguments.repeats)
        ]
    ours, theirs = (median(column) for column in zip(*turns, strict=True))
    print(
        f'{arguments.seconds:g} s of bag: read_bag {ours:.3f} s, mcap alone {theirs:.3f} s, '
        f'{ours / theirs:.1f} times'
    )


if __name__ == '__main__':
    main()
