# SPDX-License-Identifier: Apache-2.0
"""What a missing torque may depend on, and through what it may act."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace

import numpy as np

from leo_diffmodel.explain.settings import Grids
from leo_diffmodel.explain.unknown.influence import Influence

Array = np.ndarray


@dataclass(frozen=True)
class Variable:
    """One quantity along the data.

    Attributes:
        name: angle, rate, input, load or time.
        of: the joint whose quantity it is; '' for time.
        unit: of its values.
        values: in each stretch, shape (W, G).
        knots: where its curve is read, ascending.
        period: after which the curve repeats; None for one that does not.
    """

    name: str
    of: str
    unit: str
    values: Array
    knots: Array
    period: float | None = None

    @property
    def kind(self) -> tuple[str, str, float | None, int]:
        """What stays when the data are looked at from another model."""
        return self.name, self.of, self.period, len(self.knots)

    def hats(self, values: Array) -> Array:
        """Piecewise linear basis with one column for each knot, shape (..., B)."""
        if self.period is not None:
            return _ring(values, self.knots, self.period)
        at = np.clip(values, self.knots[0], self.knots[-1])
        eye = np.eye(len(self.knots))
        columns = [np.interp(at, self.knots, row) for row in eye]
        return np.stack(columns, axis=-1)


def variables(left: Influence, joint: int) -> Iterator[Variable]:
    """Everything that the torque at a joint may depend on; where a robot stands does not count."""
    robot, windows = left.model.robot, left.problem.windows
    base, grids = len(robot.base_joints), left.problem.grids
    for j, name in enumerate(robot.joint_names[base:], base):
        yield from _angles(name, left.q[..., j], grids)
        yield from _spread('rate', name, 'rad/s', left.dq[..., j], grids)
    inputs = left.averaged(windows.inputs)
    for a, actuator in enumerate(robot.actuators):
        if np.ptp(inputs[..., a]) > 0 and robot.input != 'position':  # goals act in the loop alone
            yield from _spread('input', actuator.joint, robot.input_unit, inputs[..., a], grids)
    if len(robot.joint_names) > 1:  # on a single hinge the load is a function of the angle
        load = left.model.rigid.load(left.q)[..., joint]
        yield from _spread('load', robot.joint_names[joint], 'N m', load, grids)
    yield _time(left)


def _angles(joint: str, q: Array, grids: Grids) -> Iterator[Variable]:
    """The angle as it is, and within the turn where the joint goes round."""
    yield from _spread('angle', joint, 'rad', q, grids)
    turn = 2 * np.pi
    if np.ptp(q) > turn:
        for count in grids.turn_knots:
            yield Variable('angle', joint, 'rad', q, turn * np.arange(count) / count, turn)


def _time(left: Influence) -> Variable:
    """Time, too slow to follow single windows."""
    middle = left.time
    low, high = float(middle.min()), float(middle.max())
    count = max(2, round((high - low) / left.problem.grids.slow_seconds) + 1)
    return Variable('time', '', 's', middle, np.linspace(low, high, count))


def _spread(name: str, of: str, unit: str, values: Array, grids: Grids) -> Iterator[Variable]:
    """Knots evenly over all but the outermost values, few and many."""
    low, high = np.quantile(values, (grids.tail, 1 - grids.tail))
    for count in grids.knots:
        knots = np.linspace(low, max(high, low + 1e-9), count)
        yield Variable(name, of, unit, values, knots)


def ring(variable: Variable, period: float, count: int) -> Variable:
    """The variable within one period, with so many knots."""
    knots = period * np.arange(count) / count
    return replace(variable, knots=knots, period=period)


def _ring(values: Array, knots: Array, period: float) -> Array:
    """Hats around a circle."""
    away = np.abs(values[..., None] - knots) % period
    away = np.minimum(away, period - away)
    return np.maximum(0.0, 1.0 - away * (len(knots) / period))
