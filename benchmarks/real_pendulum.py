# SPDX-License-Identifier: Apache-2.0
"""The real pendulum (DFKI): repair the CAD model from three runs, score it on the fourth.

    python benchmarks/real_pendulum.py [../shared/data/dfki_simple_pendulum]

Score: windows of 0.5 s, one every 0.25 s, of the energy-shaping run that no fit saw; those that
move less than 0.1 rad are left out. The error of a window is the rms error of the angle over it;
printed is the median over windows, which hand pushes do not move. A window starts from the
measured angle and rate. The rate is noisy (0.15 rad/s, which alone makes 0.03 rad), so the
second column starts from its mean over five samples.
"""

from __future__ import annotations

from pathlib import Path
import subprocess
import sys
import tempfile

import numpy as np
from rich.console import Console
from rich.table import Table

from leo_diffmodel.bags.recording import read_bag, Recording
from leo_diffmodel.compare import errors, noise
from leo_diffmodel.compare.windows import cut, Windows
from leo_sim.model import Model
from leo_sim.model.batch import rollout
from leo_sim.model.model_file import load_model

RUNS = ('ddp', 'direct_collocation', 'pd.system_identification', 'energy_shaping')
DATA = Path(__file__).resolve().parents[2] / 'shared/data/dfki_simple_pendulum'


def window_error(model: Model, recording: Recording, mean_of: int) -> float:
    """Median over the moving windows of the rms angle error [rad]."""
    history = noise.HISTORY if errors.has_memory(model) else 0.0
    windows = cut([recording], 0.5, stride=0.25, history=history)
    moving = np.ptp(windows.q[..., 0], axis=1) > 0.1
    rate = start_rate(recording, windows, mean_of)
    predicted, _ = rollout(
        model,
        windows.q[:, 0],
        rate,
        windows.inputs,
        windows.dt,
        enabled=windows.enabled,
        history=windows.history,
    )
    error = (windows.q - predicted)[moving, :, 0]
    return float(np.median(np.sqrt((error**2).mean(axis=1))))


def start_rate(recording: Recording, windows: Windows, mean_of: int) -> np.ndarray:
    """Measured rate at each window's start, averaged over `mean_of` samples about it."""
    episode = recording.episodes[0]
    at = np.searchsorted(episode.t, windows.start - 1e-9)
    half = mean_of // 2
    return np.stack([episode.dq[max(0, i - half) : i + half + 1].mean(axis=0) for i in at])


def leo(*words: str) -> None:
    """Run a leo command; 0 and 1 are answers, anything else ends the benchmark."""
    status = subprocess.run([Path(sys.executable).with_name('leo'), *words], check=False)
    if status.returncode > 1:
        sys.exit(status.returncode)


def main() -> None:
    """Import, repair, score, print."""
    data = Path(sys.argv[1]) if len(sys.argv) > 1 else DATA
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        for run in RUNS:
            log = data / f'control_method_{run}.data_measured.csv'
            leo('import', str(log), '--map', 'dfki_simple_pendulum', '-o', str(folder / run))
        bags = [str(folder / run) for run in RUNS]
        leo(
            'repair',
            *bags[:3],
            '--hold-out',
            bags[3],
            '--model',
            'torque_pendulum',
            '-o',
            str(folder / 'repair'),
        )
        models = {
            'CAD': load_model('torque_pendulum'),
            'repaired': load_model(folder / 'repair/model.yaml'),
        }
        held = read_bag(bags[3], models['CAD'].robot)
    table = Table(
        'model',
        'from the measured start',
        'rate averaged over 5 samples',
        title='median 0.5 s window error on energy shaping, held out [rad]',
    )
    for label, model in models.items():
        table.add_row(label, *(f'{window_error(model, held, n):.4f}' for n in (1, 5)))
    Console().print(table)


if __name__ == '__main__':
    main()
