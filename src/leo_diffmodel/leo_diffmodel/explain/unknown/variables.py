# SPDX-License-Identifier: Apache-2.0
"""What a missing torque may depend on, and through what it may act."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace

import numpy as np

from leo_diffmodel.explain.unknown.influence import Influence

Array = np.ndarray
TURN = 2 * np.pi
SLOW_SECONDS = 4.0
KNOTS = (8, 24)
TURN_KNOTS = (12, 32)
TAIL = 0.01


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
    base = len(robot.base_joints)
    for j, name in enumerate(robot.joint_names[base:], base):
        yield from _angles(name, left.q[..., j])
        yield from _spread('rate', name, 'rad/s', left.dq[..., j])
    inputs = left.averaged(windows.inputs)
    for a, actuator in enumerate(robot.actuators):
        if np.ptp(inputs[..., a]) > 0 and robot.input != 'position':  # goals act in the loop alone
            yield from _spread('input', actuator.joint, robot.input_unit, inputs[..., a])
    if len(robot.joint_names) > 1:  # on a single hinge the load is a function of the angle
        load = left.model.rigid.load(left.q)[..., joint]
        yield from _spread('load', robot.joint_names[joint], 'N m', load)
    yield _time(left)


def _angles(joint: str, q: Array) -> Iterator[Variable]:
    """The angle as it is, and within the turn where the joint goes round."""
    yield from _spread('angle', joint, 'rad', q)
    if np.ptp(q) > TURN:
        for count in TURN_KNOTS:
            yield Variable('angle', joint, 'rad', q, TURN * np.arange(count) / count, TURN)


def _time(left: Influence) -> Variable:
    """Time, too slow to follow single windows."""
    middle = left.time
    low, high = float(middle.min()), float(middle.max())
    count = max(2, round((high - low) / SLOW_SECONDS) + 1)
    return Variable('time', '', 's', middle, np.linspace(low, high, count))


def _spread(name: str, of: str, unit: str, values: Array) -> Iterator[Variable]:
    """Knots evenly over all but the outermost values, few and many."""
    low, high = np.quantile(values, (TAIL, 1 - TAIL))
    for count in KNOTS:
        knots = np.linspace(low, max(high, low + 1e-9), count)
        yield Variable(name, of, unit, values, knots)


def ring(variable: Variable, period: float) -> Variable:
    """The variable within one period."""
    knots = period * np.arange(TURN_KNOTS[0]) / TURN_KNOTS[0]
    return replace(variable, knots=knots, period=period)


def _ring(values: Array, knots: Array, period: float) -> Array:
    """Hats around a circle."""
    away = np.abs(values[..., None] - knots) % period
    away = np.minimum(away, period - away)
    return np.maximum(0.0, 1.0 - away * (len(knots) / period))
