# SPDX-License-Identifier: Apache-2.0
"""Cut the public recording of a Staubli TX40 into runs that `leo import --map map.yaml` reads.

The two files (github thanhndv212/figaroh-examples, examples/staubli_TX40, commit c0b5c7f0) have no
times: 5 kHz, motor side. The arm moves for 7.5 s: the first two thirds become run_0.csv, to learn
from, the last third run_1.csv, to hold out, both at 500 Hz. A row holds the angles at its time, as
sampled and not filtered, and the mean torque of the ten samples until the next row: what acts in
between.

    python benchmarks/rigs/tx40/prepare.py FOLDER_OF_THE_FILES FOLDER_OF_THE_RUNS
"""

from pathlib import Path
import sys

import numpy as np

PERIOD = 0.0002  # s, of the public files (TX40_config.yaml: ts)
EACH = 10  # samples to a row
ENDS = 5.0, 7.5  # s, of the runs; then the arm stands
NAMES = [f'{what}_{joint}' for what in ('angle', 'torque') for joint in range(1, 7)]


def rows(angles: np.ndarray, torques: np.ndarray) -> np.ndarray:
    """Return time [s], six motor angles [rad] and six mean motor torques [N m] a row, (T, 13)."""
    count = round(ENDS[-1] / PERIOD) // EACH
    means = torques[: count * EACH].reshape(count, EACH, -1).mean(axis=1)
    times = np.arange(count) * EACH * PERIOD
    return np.column_stack([times, angles[: count * EACH : EACH], means])


def prepare(public: Path, output: Path) -> None:
    """Write run_0.csv and run_1.csv."""
    angles, torques = (
        np.loadtxt(public / name, delimiter=',', skiprows=1)
        for name in ('pos_read_data.csv', 'curr_data.csv')
    )
    output.mkdir(parents=True, exist_ok=True)
    table = rows(angles, torques)
    cuts = np.searchsorted(table[:, 0], ENDS[:-1])
    for number, run in enumerate(np.split(table, cuts)):
        run[:, 0] -= run[0, 0]
        path = output / f'run_{number}.csv'
        np.savetxt(path, run, '%.9g', ',', header=','.join(['time', *NAMES]), comments='')


if __name__ == '__main__':
    if len(sys.argv) != 3:
        sys.exit('usage: prepare.py FOLDER_OF_THE_FILES FOLDER_OF_THE_RUNS')
    prepare(Path(sys.argv[1]), Path(sys.argv[2]))
