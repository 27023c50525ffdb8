# SPDX-License-Identifier: Apache-2.0
"""The real servo (Rhoban BAM, XL330): what its datasheet model lacks, one firmware gain held out.

    python benchmarks/real_servo.py [400 800] [--data ../shared/data/bam_xl330] [--keep DIR]

For each gain: `leo repair` learns from the runs of the other gains. Beside it the usual model,
viscous and Coulomb friction, fitted by the same engine to the same windows; motor constant,
resistance, rotor inertia and zero offset are refitted in both. Score: rms angle error of 0.5 s
open-loop windows of the held-out runs, driven by the measured voltage (duty x measured supply).
"""

from __future__ import annotations

import argparse
import json
from pathlib import Path
import tempfile

import numpy as np
from rich.console import Console
from rich.table import Table
from rig import DATA, imported, leo, refitted, window_errors

from leo_diffmodel.bags.recording import read_bag
from leo_sim.model.model_file import load_model

ROBOT = 'servo_pendulum'
USUAL = ('viscous_friction:pivot', 'coulomb_friction:pivot')


def gains(data: Path) -> dict[str, int]:
    """Firmware gain of each log."""
    return {p.stem: json.loads(p.read_text())['kp'] for p in sorted(data.glob('*.json'))}


def score(
    gain: int, bags: list[Path], gain_of: dict[str, int], folder: Path, table: Table
) -> None:
    """Learn from the other gains and add this one's errors to the table."""
    held = [b for b in bags if gain_of[b.name] == gain]
    others = [b for b in bags if gain_of[b.name] != gain]
    output = folder / f'without_{gain}'
    leo('repair', *others, '--hold-out', *held, '--model', ROBOT, '-o', output)
    given = load_model(ROBOT)
    runs, unseen = ([read_bag(b, given.robot) for b in part] for part in (others, held))
    models = {
        'as given': given,
        'constants refitted': refitted(given, (), runs, unseen),
        'viscous + Coulomb': refitted(given, USUAL, runs, unseen),
        'explained': load_model(output / 'model.yaml'),
    }
    errors = {name: window_errors(model, unseen, 0.5) for name, model in models.items()}
    rms = {name: float(np.sqrt((e**2).mean())) for name, e in errors.items()}
    for name, e in errors.items():
        ratio, median = rms[name] / rms['viscous + Coulomb'], float(np.median(e))
        table.add_row(str(gain), name, f'{rms[name]:.4f}', f'{median:.4f}', f'{ratio:.3f}')


def main() -> None:
    """Import, learn, score, print."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument('gains', nargs='*', type=int, default=[400, 800], help='to hold out')
    parser.add_argument('--data', type=Path, default=DATA / 'bam_xl330')
    parser.add_argument('--keep', type=Path, help='folder for bags, models and reports')
    options = parser.parse_args()
    table = Table(
        'held out: gain',
        'model',
        'rms [rad]',
        'median [rad]',
        'rms ratio',
        title='0.5 s windows of the held-out gain',
    )
    with tempfile.TemporaryDirectory() as name:
        folder = options.keep or Path(name)
        bags = imported(options.data.glob('*.json'), 'bam_xl330', folder / 'bags')
        for gain in options.gains:
            score(gain, bags, gains(options.data), folder, table)
    Console().print(table)


if __name__ == '__main__':
    main()
