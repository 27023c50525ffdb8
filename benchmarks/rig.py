# SPDX-License-Identifier: Apache-2.0
"""What the benchmarks share: logs to bags, leo commands, refits of a fixed hypothesis, scores."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from pathlib import Path
import subprocess
import sys

import numpy as np

from leo_diffmodel.bags.recording import Recording
from leo_diffmodel.compare.windows import cut, thin, Windows
from leo_diffmodel.explain.estimate.fit import fit
from leo_diffmodel.explain.problem.candidates import candidates, uncertain
from leo_diffmodel.explain.problem.hypothesis import Hypothesis
from leo_diffmodel.explain.problem.pose import pose
from leo_sim.model import Model
from leo_sim.model.batch import rollout

DATA = Path(__file__).resolve().parents[2] / 'shared/data'
START_SECONDS = 0.02


def leo(*words: object) -> None:
    """Run a leo command; 0 and 1 are answers, anything else ends the benchmark."""
    command = [Path(sys.executable).with_name('leo'), *map(str, words)]
    status = subprocess.run(command, check=False)
    if status.returncode > 1:
        sys.exit(status.returncode)


def imported(logs: Iterable[Path], column_map: str, folder: Path) -> list[Path]:
    """One bag for each log, in the order of the names."""
    logs = sorted(logs)
    if not logs:
        sys.exit('no logs there; give the folder of the recordings as argument')
    leo('import', *logs, '--map', column_map, '--bag-per-log', '-o', folder)
    return [folder / log.stem for log in logs]


def refitted(
    model: Model,
    labels: Sequence[str],
    recordings: Sequence[Recording],
    hold_out: Sequence[Recording],
) -> Model:
    """`model` with the effects `labels` and its uncertain constants fitted to `recordings`.

    The fit is the one of `leo explain`, on the same windows. It starts from several amplitudes,
    because dry friction has no slope at zero, and the best is taken.
    """
    data = thin([*recordings, *hold_out])
    split = len(recordings)
    problem = pose(data[:split], data[split:], model).problem
    known = {c.label: c for c in candidates(model)}
    hypothesis = Hypothesis(tuple(known[label] for label in labels), uncertain(model))
    effects = hypothesis.size - len(hypothesis.constants)
    fits = []
    for amplitude in (0.0, 0.01, 0.05, 0.2) if effects else (0.0,):
        theta = hypothesis.neutral.copy()
        theta[:effects] += amplitude
        fits.append(fit(problem, hypothesis, theta, iterations=20))
    best = min(fits, key=lambda f: float(f.loss[problem.train].sum()))
    return hypothesis.model(model, best.theta)


def window_errors(
    model: Model, recordings: Sequence[Recording], seconds: float, moving: float = 0.1
) -> np.ndarray:
    """Rms angle error [rad] of open-loop windows, one every 0.1 s, that move so many rad or more.

    A window starts from a parabola through the angles within 0.02 s of its first sample, because
    reported rates may be late; a model that knows how late is told that these are not.
    """
    prompt = [p for p in model.effects if p.effect.name != 'velocity_lag']
    model = model.changed(effects=prompt)
    windows = cut(recordings, seconds, stride=0.1, history=0.15)
    windows = windows.take(np.ptp(windows.q, axis=1).max(axis=-1) > moving)
    q, dq = starts(recordings, windows)
    predicted, _ = rollout(
        model, q, dq, windows.inputs, windows.dt, enabled=windows.enabled, history=windows.history
    )
    return np.sqrt(((windows.q - predicted) ** 2).mean(axis=(1, 2)))


def starts(recordings: Sequence[Recording], windows: Windows) -> tuple[np.ndarray, np.ndarray]:
    """Angle and rate at each window's start from the angles around it, shape (W, J) each."""
    found = [
        _parabola(recordings[source], float(start))
        for source, start in zip(windows.source, windows.start, strict=True)
    ]
    return np.stack([f[0] for f in found]), np.stack([f[1] for f in found])


def _parabola(recording: Recording, start: float) -> np.ndarray:
    episode = next(e for e in recording.episodes if e.t[0] <= start <= e.t[-1])
    near = np.abs(episode.t - start) <= START_SECONDS
    powers = np.vander(episode.t[near] - start, 3, increasing=True)
    return np.linalg.lstsq(powers, episode.q[near], rcond=None)[0]
