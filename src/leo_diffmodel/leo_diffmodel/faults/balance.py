# SPDX-License-Identifier: Apache-2.0
"""The balance of torques at one joint: what share of its weight and of its motor moves it.

What the motion takes is what gravity, motor and losses give. Each is known from the log and the
model up to a factor, and the factors are fitted, so that a model whose friction is not known
still shows whether gravity pulls the way it should and whether the motor does.
"""

from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np

from leo_diffmodel.faults.catalogue import FAULTS
from leo_diffmodel.faults.settings import LIMITS
from leo_diffmodel.outside.flow import Flow
from leo_diffmodel.outside.ordinary import losses
from leo_diffmodel.outside.samples import Array, block_covariance, reweighted

GIVEN = ('weight', 'across', 'motor', 'late')


@dataclass(frozen=True)
class Figure:
    """A factor, its standard deviation, and how far it is off at worst.

    The worst is what it would change by if all that is left over were of its kind.
    """

    value: float
    sd: float
    worst: float

    @property
    def half(self) -> float:
        """Half of the interval in which it is, whatever the model lacks."""
        return LIMITS.sigmas * self.sd + self.worst


@dataclass(frozen=True)
class Balance:
    figures: Mapping[str, Figure]
    """By name: `weight`, of gravity, and `across` it (as if the joint were a quarter of a turn
    on); `motor`; `late`, how much later the motor acts [s]. Some are missing where they do not
    show: a wheel has no weight."""
    shares: Mapping[str, float]  # rms of what each gives, as a share of that of all torques
    gained: float = 1.0
    """What is left over with the best delay, as a share of what is left with the best of those
    that a good log has."""


def balance(flow: Flow, j: int) -> Balance | None:
    """Fit the factors of joint j; None where it hardly moves."""
    fitted = flow.moving[:, j] > LIMITS.moving
    if fitted.sum() < LIMITS.fewest_instants:
        return None
    motor = flow.motor[:, j]
    target = flow.load[:, j] + motor + flow.missing[:, j]  # what motion and losses take [N m, N]
    rest = _columns(flow, j)

    def columns(late: float) -> dict[str, Array]:
        moving = {k: v[fitted] for k, v in (rest | _motor(flow, motor, late)).items()}
        return {k: v for k, v in moving.items() if np.abs(v).max() > 1e-12}

    reach = round(LIMITS.latest / LIMITS.late_grid) if np.abs(motor).max() > 1e-12 else 0
    delays = LIMITS.late_grid * np.arange(-reach, reach + 1)
    losses = {late: _loss(columns(late), target[fitted]) for late in delays}
    late = min(losses, key=losses.__getitem__)
    found = _fitted(flow, fitted, target[fitted], columns(late))
    if 'late' not in found.figures:
        return found
    nearer = _seconds(found, late).value
    if abs(nearer - late) <= LIMITS.late_grid and abs(nearer) <= LIMITS.latest:
        losses[nearer], late = _loss(columns(nearer), target[fitted]), nearer
        found = _fitted(flow, fitted, target[fitted], columns(late))
    least, most = FAULTS['input_late'].harmless
    good = min(size for at, size in losses.items() if least <= at <= most)
    figures = {**found.figures, 'late': _seconds(found, late)}
    return replace(found, figures=figures, gained=losses[late] / good)


def _seconds(found: Balance, shift: float) -> Figure:
    """The delay from the shift that was tried and what the slope of the motor adds to it."""
    slope, gain = found.figures['late'], max(abs(found.figures['motor'].value), 1e-9)
    return Figure(shift + slope.value / gain, slope.sd / gain, slope.worst / gain)


def _columns(flow: Flow, j: int) -> dict[str, Array]:
    """Weight, and all that takes energy or is constant."""
    model, load = flow.motion.model, flow.load[:, j]
    turned = flow.q.copy()
    turned[:, j] += 0.5 * np.pi
    slides = model.robot.joint_names[j] in model.robot.slides
    across = np.zeros_like(load) if slides else model.rigid.load(turned)[:, j]
    return {'weight': load, 'across': across, **losses(flow, j), 'constant': np.ones_like(load)}


def _motor(flow: Flow, motor: Array, late: float) -> dict[str, Array]:
    """The motor `late` s ago, and what it would change by if it were later still."""
    moved, slope = np.empty_like(motor), np.empty_like(motor)
    for number in np.unique(flow.episode):
        here = flow.episode == number
        t = flow.time[here]
        moved[here] = np.interp(t - late, t, motor[here])
        slope[here] = np.gradient(moved[here], t) if len(t) > 1 else 0.0
    return {'motor': moved, 'late': -slope}


def _loss(columns: dict[str, Array], y: Array) -> float:
    """Size of what the columns leave over, but for how it would change with the delay."""
    a = np.stack([x for name, x in columns.items() if name != 'late'], axis=1)
    left = y - a @ np.linalg.lstsq(a, y, rcond=1e-9)[0]
    return float(np.abs(left).sum())


def _fitted(flow: Flow, fitted: Array, y: Array, used: dict[str, Array]) -> Balance:
    size = np.array([np.sqrt((v**2).mean()) for v in used.values()])
    a = np.stack([*used.values()], axis=1) / size

    def solve(weight: Array) -> Array:
        return np.asarray(np.linalg.pinv(a.T @ (weight[:, None] * a)) @ (a.T @ (weight * y)))

    amounts, weight = reweighted(solve, a, y, 1e-9 * float(np.abs(y).max()) + 1e-300)
    left = y - a @ amounts
    inverse = np.linalg.pinv(a.T @ (weight[:, None] * a))
    sd = _spread(a, weight * left, inverse, flow, fitted) / size
    rms = float(np.sqrt((weight * left**2).sum() / weight.sum()))
    worst = rms * np.sqrt(np.maximum(inverse.diagonal(), 0) * weight.sum()) / size
    each = zip(used, amounts / size, sd, worst, strict=True)
    figures = {n: Figure(float(v), float(s), float(w)) for n, v, s, w in each if n in GIVEN}
    whole = max(float(np.sqrt((y**2).mean())), 1e-300)
    shares = {name: abs(float(v)) / whole for name, v in zip(used, amounts, strict=True)}
    return Balance(figures, shares)


def _spread(a: Array, left: Array, inverse: Array, flow: Flow, fitted: Array) -> Array:
    """Standard deviations from blocks of 1 s; infinite where there are no more than columns."""
    times = (flow.time[fitted] / LIMITS.block).astype(int)
    _, block = np.unique(np.stack([flow.episode[fitted], times]), axis=1, return_inverse=True)
    if block.max() + 1 <= a.shape[1]:
        return np.full(a.shape[1], np.inf)
    covariance = block_covariance(inverse, left[:, None] * a, block.ravel())
    return np.sqrt(np.maximum(covariance.diagonal(), 0))
