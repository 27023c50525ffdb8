# SPDX-License-Identifier: Apache-2.0
"""What is left as a free function of every variable, at every joint."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace

import numpy as np

from leo_diffmodel.explain.unknown.influence import Influence
from leo_diffmodel.explain.unknown.regression import Regression, Score
from leo_diffmodel.explain.unknown.variables import Variable, variables

Array = np.ndarray
CARRIERS = {
    'rate': ('torque',),
    'angle': ('torque', 'friction', 'drive'),
    'input': ('torque',),
    'load': ('torque', 'friction'),
    'time': ('torque', 'friction', 'drive'),
    'path': ('torque',),
}
"""How a torque may depend on each variable: it is the torque, a level of dry friction against
motion, or a share of the motor's own torque."""


@dataclass(frozen=True)
class Curve:
    """A torque at one joint as a free function of one variable.

    Attributes:
        joint: index of the joint it acts at.
        variable: what it depends on.
        carrier: 'torque', 'friction' or 'drive'; see `CARRIERS`.
        hertz: of a torque periodic in time, whose values are those of sine and cosine; else 0.
        score: coefficients and gains; the coefficients are the values at the knots.
    """

    joint: int
    variable: Variable
    carrier: str
    hertz: float
    score: Score

    @property
    def gain(self) -> float:
        """In all folds, each predicted from the others [nats]."""
        return float(self.score.gain)

    @property
    def at_knots(self) -> bool:
        """Whether its coefficients are its values at the knots of the variable."""
        return self.variable.name != 'path' and not self.hertz


def curves(left: Influence, paths: dict[float, Array]) -> list[Curve]:
    """The curve of every variable at every joint, best in the folds left out first.

    Args:
        left: what is left.
        paths: for each reach [rad], how far each joint is along its hysteresis, (W, G, J).
    """
    found = []
    robot = left.model.robot
    for joint in range(len(robot.base_joints), len(robot.joint_names)):
        regression = Regression(left, joint)
        found += list(_at_joint(left, regression, joint))
        found += [_along(left, regression, joint, r, z[..., joint]) for r, z in paths.items()]
    return sorted(found, key=lambda c: -c.gain)


def _at_joint(left: Influence, regression: Regression, joint: int) -> Iterator[Curve]:
    for variable in variables(left, joint):
        for carrier in CARRIERS[variable.name]:
            carried = carry(left, carrier, joint)
            if carried is not None:
                basis = variable.hats(variable.values) * carried[..., None]
                score = regression.of(basis[:, :, None])
                yield Curve(joint, variable, carrier, 0.0, score.at(0))
        if variable.name == 'time':
            yield _periodic(left, regression, joint, variable)


def _along(left: Influence, regression: Regression, joint: int, reach: float, z: Array) -> Curve:
    """Friction that follows the direction of motion over a distance."""
    name = left.model.robot.joint_names[joint]
    variable = Variable('path', name, '', z, np.array([reach]))
    return Curve(joint, variable, 'torque', 0.0, regression.of(-z[:, :, None, None]).at(0))


def _periodic(left: Influence, regression: Regression, joint: int, variable: Variable) -> Curve:
    """The best sine in time."""
    span, grids = float(np.ptp(variable.values)), left.problem.grids
    period = float(np.median(left.problem.windows.dt))
    highest = min(grids.fastest_hz, grids.of_rate / period)
    grid = np.arange(1.0 / span, highest, 1.0 / (grids.per_period * span))
    parts = max(1, len(grid) // left.problem.numerics.at_once)
    tried = [
        (f, s)
        for part in np.array_split(grid, parts)
        for f, s in _each(part, regression.of(waves(variable.values, part)))
    ]
    best, score = max(tried, key=lambda t: float(t[1].gain))
    return Curve(joint, variable, 'torque', best, score)


def _each(hertz: Array, scores: Score) -> Iterator[tuple[float, Score]]:
    return ((float(f), scores.at(i)) for i, f in enumerate(hertz))


def waves(time: Array, hertz: Array) -> Array:
    """Sine and cosine of each frequency, shape (..., F, 2)."""
    phase = 2 * np.pi * time[..., None] * hertz
    return np.stack([np.sin(phase), np.cos(phase)], axis=-1)


def again(left: Influence, curve: Curve) -> Curve:
    """This curve from another linearisation."""
    variable = next(v for v in variables(left, curve.joint) if v.kind == curve.variable.kind)
    carried = carry(left, curve.carrier, curve.joint)
    assert carried is not None
    basis = variable.hats(variable.values)
    if curve.hertz:
        basis = waves(variable.values, np.array([curve.hertz]))[:, :, 0]
    score = Regression(left, curve.joint).of((basis * carried[..., None])[:, :, None])
    return replace(curve, variable=variable, score=score.at(0))


def carry(left: Influence, carrier: str, joint: int) -> Array | None:
    """What the curve is multiplied with, shape (W, G); None where the joint has no such thing."""
    if carrier == 'torque':
        return np.ones(left.q.shape[:-1])
    if carrier == 'friction':
        rate, width = left.dq[..., joint], left.problem.grids.smooth_sign
        return -np.tanh(rate / (width * float(np.sqrt((rate**2).mean())) + 1e-12))
    if joint not in left.model.robot.actuated:
        return None
    return drive(left)[..., joint]


def drive(left: Influence) -> Array:
    """The motors' own torque at each joint [N m], shape (W, G, J)."""
    windows, laws = left.problem.windows, left.model.laws
    inputs = left.averaged(windows.inputs)
    enabled = left.averaged(windows.enabled.astype(float)) > 0.5
    load = left.model.rigid.load(left.q) if laws.needs_load else None
    return np.asarray(laws.torques(left.q, left.dq, left.dq, inputs, enabled, load).motor)
