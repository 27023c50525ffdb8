# SPDX-License-Identifier: Apache-2.0
"""What is left as a free function of every variable, at every joint."""

from collections.abc import Iterator
from dataclasses import dataclass, replace

import numpy as np

from leo_diffmodel.bags.recording import Episode, Recordings
from leo_diffmodel.compare.windows import Array
from leo_diffmodel.explain.settings import Grids
from leo_diffmodel.explain.unknown.influence import Influence
from leo_diffmodel.explain.unknown.regression import Regression, Score

CARRIERS = {
    'rate': ('torque',),
    'angle': ('torque', 'friction', 'drive'),
    'input': ('torque',),
    'load': ('torque', 'friction'),
    'time': ('torque', 'friction', 'drive'),
}
"""How a torque may depend on each variable: it is the torque, a level of dry friction against
motion, or a share of the motor's own torque."""


@dataclass(frozen=True)
class Variable:
    name: str  # angle, rate, input, load, time or path
    of: str  # the joint whose quantity it is; '' for time
    unit: str  # of its values
    values: Array  # in each stretch, shape (W, G)
    knots: Array  # where its curve is read, ascending
    period: float | None = None  # after which the curve repeats; None for one that does not

    @property
    def kind(self) -> tuple[str, str, float | None, int]:
        """What stays when the data are looked at from another model."""
        return self.name, self.of, self.period, len(self.knots)

    def hats(self, values: Array) -> Array:
        """Piecewise linear basis with one column for each knot, shape (..., B)."""
        if self.period is not None:
            away = np.abs(values[..., None] - self.knots) % self.period
            away = np.minimum(away, self.period - away)
            return np.maximum(0.0, 1.0 - away * (len(self.knots) / self.period))
        at = np.clip(values, self.knots[0], self.knots[-1])
        return np.stack([np.interp(at, self.knots, row) for row in np.eye(len(self.knots))], -1)

    def ring(self, period: float, count: int) -> 'Variable':
        """The variable within one period, with so many knots."""
        return replace(self, knots=period * np.arange(count) / count, period=period)


@dataclass(frozen=True)
class Curve:
    """A torque at one joint as a free function of one variable."""

    joint: int  # index of the joint it acts at
    variable: Variable  # what it depends on
    carrier: str  # 'torque', 'friction' or 'drive'; see `CARRIERS`
    hertz: float  # of a torque periodic in time, whose values are those of sine and cosine; else 0
    score: Score  # coefficients and gains; the coefficients are the values at the knots

    @property
    def gain(self) -> float:
        """In all folds, each predicted from the others [nats]."""
        return float(self.score.gain)

    def seen_from(self, left: Influence) -> Variable:
        """Its variable along the data as another model predicts them."""
        return next(v for v in variables(left, self.joint) if v.kind == self.variable.kind)

    def again(self, left: Influence) -> 'Curve':
        """This curve from another linearisation."""
        variable, regression = self.seen_from(left), Regression(left, self.joint)
        score = regressed(regression, variable, self.carrier, self.hertz)
        assert score is not None
        return replace(self, variable=variable, score=score)


def curves(left: Influence, paths: dict[float, Array]) -> list[Curve]:
    """The curve of every variable at every joint, best in the folds left out first."""
    found, robot = [], left.model.robot
    for joint in range(len(robot.base_joints), len(robot.joint_names)):
        regression = Regression(left, joint)
        for variable in variables(left, joint):
            for carrier in CARRIERS[variable.name]:
                score = regressed(regression, variable, carrier)
                if score is not None:
                    found.append(Curve(joint, variable, carrier, 0.0, score))
            if variable.name == 'time':
                found.append(_periodic(regression, variable))
        for reach, z in paths.items():  # friction follows the direction of motion over a distance
            path = Variable('path', robot.joint_names[joint], '', z[..., joint], np.array([reach]))
            by_path = regression.of(-path.values[..., None, None]).at(0)
            found.append(Curve(joint, path, 'torque', 0.0, by_path))
    return sorted(found, key=lambda c: -c.gain)


def regressed(
    regression: Regression, variable: Variable, carrier: str, hertz: float = 0.0
) -> Score | None:
    """The values at the knots of a variable, or of sine and cosine; None where nothing carries."""
    carried = carry(regression.left, carrier, regression.joint)
    if carried is None:
        return None
    basis = variable.hats(variable.values)
    if hertz:
        basis = waves(2 * np.pi * variable.values, np.array([hertz]))[:, :, 0]
    return regression.of((basis * carried[..., None])[:, :, None]).at(0)


def _periodic(regression: Regression, variable: Variable) -> Curve:
    problem, span = regression.left.problem, float(np.ptp(variable.values))
    grids, period = problem.grids, float(np.median(problem.windows.dt))
    highest = min(grids.fastest_hz, grids.of_rate / period)
    grid = np.arange(1.0 / span, highest, 1.0 / (grids.per_period * span))
    parts = np.array_split(grid, max(1, len(grid) // problem.numerics.at_once))
    turned = 2 * np.pi * variable.values
    scores = [(p, regression.of(waves(turned, p))) for p in parts]
    tried = [(float(f), score.at(i)) for part, score in scores for i, f in enumerate(part)]
    best, score = max(tried, key=lambda t: float(t[1].gain))
    return Curve(regression.joint, variable, 'torque', best, score)


def waves(x: Array, rates: Array) -> Array:
    """Sine and cosine of x at each rate [rad per unit of x], shape (..., F, 2)."""
    phase = x[..., None] * rates
    return np.stack([np.sin(phase), np.cos(phase)], axis=-1)


def carry(left: Influence, carrier: str, joint: int) -> Array | None:
    """What the curve is multiplied with, shape (W, G); None where the joint has no such thing."""
    if carrier == 'torque':
        return np.ones(left.q.shape[:-1])
    if carrier == 'friction':
        rate, width = left.dq[..., joint], left.problem.grids.smooth_sign
        return -np.tanh(rate / (width * float(np.sqrt((rate**2).mean())) + 1e-12))
    if joint not in left.model.robot.actuated:
        return None
    windows, laws = left.problem.windows, left.model.laws
    inputs = left.averaged(windows.inputs)
    enabled = left.averaged(windows.enabled.astype(float)) > 0.5
    load = left.model.rigid.load(left.q) if laws.needs_load else None
    torques = laws.torques(left.q, left.dq, left.dq, inputs, enabled, load)
    return np.asarray(torques.motor)[..., joint]


def variables(left: Influence, joint: int) -> Iterator[Variable]:
    """Everything that the torque at a joint may depend on; where a robot stands does not count."""
    robot, windows = left.model.robot, left.problem.windows
    base, grids = len(robot.base_joints), left.problem.grids
    for j, name in enumerate(robot.joint_names[base:], base):
        q, turn = left.q[..., j], 2 * np.pi
        yield from _spread('angle', name, 'rad', q, grids)
        if np.ptp(q) > turn:  # where the joint goes round, also within the turn
            angle = Variable('angle', name, 'rad', q, np.zeros(0))
            yield from (angle.ring(turn, count) for count in grids.turn_knots)
        yield from _spread('rate', name, 'rad/s', left.dq[..., j], grids)
    inputs = left.averaged(windows.inputs)
    for a, actuator in enumerate(robot.actuators):
        if np.ptp(inputs[..., a]) > 0 and robot.input != 'position':  # goals act in the loop alone
            yield from _spread('input', actuator.joint, robot.input_unit, inputs[..., a], grids)
    if len(robot.joint_names) > 1:  # on a single hinge the load is a function of the angle
        load = left.model.rigid.load(left.q)[..., joint]
        yield from _spread('load', robot.joint_names[joint], 'N m', load, grids)
    time = left.time  # its knots are too slow to follow single windows
    low, high = float(time.min()), float(time.max())
    count = max(2, round((high - low) / grids.slow_seconds) + 1)
    yield Variable('time', '', 's', time, np.linspace(low, high, count))


def _spread(name: str, of: str, unit: str, values: Array, grids: Grids) -> Iterator[Variable]:
    """Knots evenly over all but the outermost values, few and many."""
    low, high = np.quantile(values, (grids.tail, 1 - grids.tail))
    for count in grids.knots:
        knots = np.linspace(low, max(high, low + 1e-9), count)
        yield Variable(name, of, unit, values, knots)


def paths(recordings: Recordings, left: Influence) -> dict[float, Array]:
    """For each reach the state of Dahl's friction in each stretch, -1 to 1, shape (W, G, J)."""
    time, windows, reaches = left.time, left.problem.windows, left.problem.grids.reaches
    z = np.zeros((len(reaches), *left.q.shape))
    for source, recording in enumerate(recordings):
        for episode in recording.episodes:
            within = (time[:, 0] >= episode.t[0]) & (time[:, -1] <= episode.t[-1])
            inside = within & (windows.source == source)
            along = dahl(episode, np.array(reaches))
            for r, j in np.ndindex(len(reaches), z.shape[-1]):
                z[r, inside, :, j] = np.interp(time[inside], episode.t, along[:, r, j])
    return dict(zip(reaches, z, strict=True))


def dahl(episode: Episode, reach: Array) -> Array:
    """The state along an episode that begins at rest, for each reach [rad], shape (T, R, J)."""
    moved = np.diff(episode.q, axis=0)[:, None, :]
    decay, way = np.exp(-np.abs(moved) / reach[:, None]), np.sign(moved)
    z = np.zeros((len(episode.q), *decay.shape[1:]))
    for k in range(len(moved)):
        z[k + 1] = way[k] + (z[k] - way[k]) * decay[k]
    return z
