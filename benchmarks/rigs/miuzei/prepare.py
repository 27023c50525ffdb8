# SPDX-License-Identifier: Apache-2.0
"""Write the public runs of a hobby servo as CSV, which `leo import --map map.yaml` reads.

dataset.json (github mauicv/servo-sysid, src/sysid/dataset, commit e4a48407) has 100 runs without
times, at a nominal 50 Hz. Chirp, steps, pseudo-random goals, ramps and unpowered drops go to
`learn`; triangles and squares, motions of other kinds, to `held`. An action of null, the pulses of
the servo off, is enabled 0 and the last goal.

    python benchmarks/rigs/miuzei/prepare.py FOLDER_OF_THE_FILES FOLDER_OF_THE_RUNS
"""

from collections.abc import Iterator
import json
from pathlib import Path
import sys
from typing import Any

PERIOD = 0.02  # s, nominal
HELD = ('triangle', 'square')


def rows(run: dict[str, Any]) -> Iterator[str]:
    """Yield a line for each sample: time [s], goal and angle as fractions of pi, enabled."""
    goal = 0.0
    for number, (action, angle) in enumerate(zip(run['actions'], run['sensor_data'], strict=True)):
        goal = goal if action is None else action
        yield f'{number * PERIOD:.2f},{goal:.6f},{angle:.6f},{int(action is not None)}\n'


def prepare(public: Path, output: Path) -> None:
    """Write learn/KIND_NUMBER.csv and held/KIND_NUMBER.csv."""
    runs = json.loads((public / 'dataset.json').read_text())['data']
    for number, run in enumerate(runs):
        folder = output / ('held' if run['type'] in HELD else 'learn')
        folder.mkdir(parents=True, exist_ok=True)
        path = folder / f'{run["type"]}_{number:02d}.csv'
        path.write_text('time,goal,angle,enabled\n' + ''.join(rows(run)))


if __name__ == '__main__':
    if len(sys.argv) != 3:
        sys.exit('usage: prepare.py FOLDER_OF_THE_FILES FOLDER_OF_THE_RUNS')
    prepare(Path(sys.argv[1]), Path(sys.argv[2]))
