# SPDX-License-Identifier: Apache-2.0
"""Sliders of parameters, fine near what changes nothing, and the values where they begin."""

from dataclasses import dataclass, replace
from math import isfinite, pi
from typing import Self

import numpy as np

from leo_diffmodel.compare.pushes import predict
from leo_diffmodel.compare.windows import per_window
from leo_diffmodel.explain.problem.hypothesis import Candidate, Hypothesis
from leo_diffmodel.watch.scene import Scene
from leo_sim.effects import Parameter
from leo_sim.model import Model

POWER = 4
DIGITS = 4
POINTS, FEWER = 41, 3  # of a slider that are tried at first, in one of so many windows
HALVINGS = 5  # of the step to both sides of the best so far
MIDDLE = 0.4  # where on its slider a parameter begins that only shapes an effect
FARTHEST = 1e6  # noise floors; a prediction that runs away is no worse than this


@dataclass(frozen=True)
class Handle:
    """The plausible range of a parameter, and where on a slider each value lies.

    Positions go from -1 (the lowest value) over 0 (as near to no effect as there is) to 1 (the
    highest value); where no effect is an end of the range, that half is not there.
    """

    parameter: Parameter
    low: float
    high: float

    @classmethod
    def of(cls, parameter: Parameter) -> Self:
        low = parameter.low if isfinite(parameter.low) else -pi
        high = parameter.high if isfinite(parameter.high) else pi
        return cls(parameter, low, high)

    @property
    def anchor(self) -> float:
        return min(max(self.parameter.neutral, self.low), self.high)

    @property
    def ends(self) -> tuple[float, float]:
        return (-1.0 if self.low < self.anchor else 0.0, 1.0 if self.high > self.anchor else 0.0)

    def value(self, position: float) -> float:
        span = self.high - self.anchor if position > 0 else self.anchor - self.low
        size = abs(position) ** POWER * span
        return self.inside(self.anchor + (size if position > 0 else -size))

    def position(self, value: float) -> float:
        off = min(max(value, self.low), self.high) - self.anchor
        span = self.high - self.anchor if off > 0 else self.anchor - self.low
        size = (abs(off) / span) ** (1 / POWER) if span else 0.0
        return float(size if off > 0 else -size)

    def inside(self, value: float) -> float:
        """As `exact`, rounded to four digits before."""
        return self.exact(float(f'{value:.{DIGITS}g}'))

    def exact(self, value: float) -> float:
        """The value within the range that is nearest; whole where it has to be."""
        within = min(max(float(value), self.low), self.high)
        return float(max(1, round(within))) if self.parameter.whole else within


def guess(scene: Scene, base: Model, candidate: Candidate) -> dict[str, float]:
    """The values at which an effect on top of a model predicts the training windows best.

    Each parameter in turn is scanned over its slider, then ever more finely about the best.
    """
    handles = [Handle.of(p) for p in candidate.parameters]
    values = np.array([_first(h) for h in handles])
    few = replace(scene, train=scene.train.take(np.arange(0, scene.train.count, FEWER)))
    for level in range(1 + HALVINGS):
        for i, handle in enumerate(handles):
            tried = _tried(handle, values[i], level)
            thetas = np.repeat(values[None], len(tried), axis=0)
            thetas[:, i] = tried
            costs = _costs(scene if level else few, base, candidate, thetas)
            values = thetas[np.argmin(costs)]
    return {h.parameter.name: h.inside(v) for h, v in zip(handles, values, strict=True)}


def _first(handle: Handle) -> float:
    scales = handle.parameter.scales or handle.parameter.turns
    return handle.anchor if scales else handle.value(MIDDLE * handle.ends[1])


def _tried(handle: Handle, value: float, level: int) -> np.ndarray:
    positions = np.linspace(*handle.ends, POINTS)
    if level:
        step = (positions[1] - positions[0]) / 2 ** (level - 1)
        positions = np.clip(handle.position(value) + step * np.array([-1, 1]), *handle.ends)
    return np.array([value, *(handle.value(p) for p in positions)])


def _costs(scene: Scene, base: Model, candidate: Candidate, thetas: np.ndarray) -> np.ndarray:
    """How far off the training windows are at each point (S, P), in noise, shape (S,)."""
    windows = scene.train
    model = Hypothesis((candidate,)).model(base, thetas)
    measured = windows.measured[:, 0]
    starts = np.broadcast_to(measured, (len(thetas), *measured.shape))
    off = (windows.measured - predict(model, windows, starts)) / per_window(scene.sigma, windows)
    size = np.sqrt(np.nan_to_num(off**2, nan=FARTHEST**2, posinf=FARTHEST**2).mean(axis=(2, 3)))
    return np.asarray(np.minimum(size, FARTHEST).mean(axis=1))
