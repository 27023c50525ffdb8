# SPDX-License-Identifier: Apache-2.0
"""The real double pendulum (DFKI, design A.0): torque that the model leaves over, held out.

    python benchmarks/real_double_pendulum.py [--data ../shared/data/dfki_double_pendulum]
        [--keep DIR]

`leo repair` learns from all files but the last two in name order, its masses, inertias and one
rotor inertia refitted (rigs/dfki_double_pendulum.yaml). Beside it the same constants refitted
without any friction: to the motion as `leo explain` does, and to the torque by least squares, the
usual way. Score: rms torque residual on the last two files, joints pooled, by inverse dynamics of
the smoothed angles (inverse_dynamics.py).
"""

from __future__ import annotations

import argparse
from pathlib import Path
import tempfile

from inverse_dynamics import refitted_by_torque, residual
import numpy as np
from rich.console import Console
from rich.table import Table
from rig import DATA, imported, leo, refitted

from leo_diffmodel.bags.recording import read_bag
from leo_sim.model.model_file import load_model

MODEL = Path(__file__).parent / 'rigs/dfki_double_pendulum.yaml'

USUAL = 'frictionless, fitted to torque'


def main() -> None:
    """Import, learn, score, print."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument('--data', type=Path, default=DATA / 'dfki_double_pendulum')
    parser.add_argument('--keep', type=Path, help='folder for bags, model and report')
    options = parser.parse_args()
    given = load_model(MODEL)
    with tempfile.TemporaryDirectory() as name:
        folder = options.keep or Path(name)
        bags = imported(options.data.glob('*.csv'), 'dfki_double_pendulum', folder / 'bags')
        output = folder / 'repair'
        leo('repair', *bags[:-2], '--hold-out', *bags[-2:], '--model', MODEL, '-o', output)
        recordings = [read_bag(bag, given.robot) for bag in bags]
        runs, unseen = recordings[:-2], recordings[-2:]
        models = {
            'as given': given,
            'frictionless, fitted to motion': refitted(given, (), runs, unseen),
            USUAL: refitted_by_torque(given, runs),
            'explained': load_model(output / 'model.yaml'),
        }
    left = {
        label: np.concatenate([residual(model, run) for run in unseen])
        for label, model in models.items()
    }
    usual = float(np.sqrt((left[USUAL] ** 2).mean()))
    table = Table(
        'model',
        'pooled [N m]',
        'shoulder',
        'elbow',
        'less than frictionless',
        title='rms torque residual, last two files, held out',
    )
    for label, torque in left.items():
        pooled, joints = np.sqrt((torque**2).mean()), np.sqrt((torque**2).mean(axis=0))
        saved = f'{100 * (1 - pooled / usual):.1f} %'
        table.add_row(label, f'{pooled:.4f}', *(f'{j:.4f}' for j in joints), saved)
    Console().print(table)


if __name__ == '__main__':
    main()
