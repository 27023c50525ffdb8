# SPDX-License-Identifier: Apache-2.0
"""A real pendulum that swings freely (Experimental Multi-Arm Pendulum): which friction is it?

    python benchmarks/real_free_swing.py [--data ../shared/data/map_single_pendulum] [--keep DIR]

The published model is m, a and I of `rigs/map_pendulum` with viscous friction k = 2.24e-4 N m
s/rad. The friction is left out, the inertia is refitted; the publication's identification pieces
are learned from and its validation pieces held out.
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

ROBOT = Path(__file__).parent / 'rigs/map_pendulum'
LOG = 'SinglePendulumDataForParameterEstimation.mat'
FIXED = ('viscous_friction', 'coulomb_friction', 'stribeck_friction', 'quadratic_drag')


def main() -> None:
    """Import, explain, compare each friction on its own, print."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument('--data', type=Path, default=DATA / 'map_single_pendulum')
    parser.add_argument('--keep', type=Path, help='folder for bags and report')
    options = parser.parse_args()
    with tempfile.TemporaryDirectory() as name:
        folder = options.keep or Path(name)
        for column_map in ('map_single_pendulum', 'map_single_pendulum_validation'):
            imported([options.data / LOG], column_map, folder / column_map)
        bag, unseen = (
            folder / m / Path(LOG).stem
            for m in ('map_single_pendulum', 'map_single_pendulum_validation')
        )
        output = folder / 'repair'
        leo('repair', bag, '--hold-out', unseen, '--model', ROBOT, '-o', output)
        answer = json.loads((output / 'explain.json').read_text())
        given = load_model(ROBOT)
        run, held = read_bag(bag, given.robot), read_bag(unseen, given.robot)
        models = {'inertia refitted': refitted(given, (), [run], [held])} | {
            f'{n} alone': refitted(given, (f'{n}:pivot',), [run], [held]) for n in FIXED
        }
        models['explained'] = load_model(output / 'model.yaml')
    table = Table('model', 'rms [rad]', title='2 s windows of the validation pieces, held out')
    for label, model in models.items():
        error = np.sqrt((window_errors(model, [held], 2.0) ** 2).mean())
        table.add_row(label, f'{error:.5f}')
    Console().print(table)
    print('named, in this order:', ', '.join(e['name'] for e in answer['effects']))
    print(answer['sentence'])


if __name__ == '__main__':
    main()
