# SPDX-License-Identifier: Apache-2.0
"""A first value for an effect that is switched on: the best of a scan on training windows."""

from __future__ import annotations

import numpy as np

from leo_diffmodel.compare.pushes import predict
from leo_diffmodel.compare.windows import per_window
from leo_diffmodel.explain.problem.hypothesis import Candidate, Hypothesis
from leo_diffmodel.watch.handle import Handle
from leo_diffmodel.watch.scene import Scene
from leo_sim.model import Model

Array = np.ndarray
SCANS = (1.0, 41), (0.05, 9), (0.012, 9)
ON_GROUND = (1.0, 21), (0.1, 7), (0.033, 7)
"""How far each scan goes to each side of the best so far, of a slider, and its points; fewer of a
robot on the ground."""
MIDDLE = 0.4
"""Where on its slider a parameter begins that only shapes an effect."""
FARTHEST = 1e6
"""Noise floors; a prediction that runs away is no worse than this."""


def guess(scene: Scene, base: Model, candidate: Candidate) -> dict[str, float]:
    """The values at which an effect on top of a model predicts the training windows best.

    Each parameter in turn is scanned over its slider, then ever more finely about the best: one
    batch of rollouts each.
    """
    handles = [Handle.of(p) for p in candidate.parameters]
    values = np.array([_begin(h) for h in handles])
    for width, points in ON_GROUND if scene.model.robot.contacts else SCANS:
        for i, handle in enumerate(handles):
            tried = _tried(handle, values[i], width, points)
            thetas = np.repeat(values[None], len(tried), axis=0)
            thetas[:, i] = tried
            values = thetas[int(np.argmin(_costs(scene, base, candidate, thetas)))]
    return {h.parameter.name: h.inside(v) for h, v in zip(handles, values, strict=True)}


def _begin(handle: Handle) -> float:
    scales = handle.parameter.scales or handle.parameter.turns
    return handle.anchor if scales else handle.value(MIDDLE * handle.ends[1])


def _tried(handle: Handle, value: float, width: float, points: int) -> Array:
    """Values so far to each side of one of them on the slider; the one itself is always there."""
    low, high = handle.ends
    if width == 1.0:
        positions = np.linspace(low, high, points)
    else:
        around = handle.position(value) + np.linspace(-width, width, points)
        positions = np.clip(around, low, high)
    return np.array([value, *(handle.value(p) for p in positions)])


def _costs(scene: Scene, base: Model, candidate: Candidate, thetas: Array) -> Array:
    """How far off the training windows are at each point (S, P), in noise, shape (S,)."""
    windows = scene.train
    model = Hypothesis((candidate,)).model(base, thetas)
    starts = np.broadcast_to(
        windows.measured[:, 0], (len(thetas), windows.count, windows.measured.shape[-1])
    )
    off = (windows.measured - predict(model, windows, starts)) / per_window(scene.sigma, windows)
    size = np.sqrt(np.nan_to_num(off**2, nan=FARTHEST**2, posinf=FARTHEST**2).mean(axis=(2, 3)))
    return np.asarray(np.minimum(size, FARTHEST).mean(axis=1))
