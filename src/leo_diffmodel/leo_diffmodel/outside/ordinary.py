# SPDX-License-Identifier: Apache-2.0
"""How much of the torque a model lacks ordinary effects can give: friction, masses, gains, lags.

Each may be only as large as it is on real robots: friction takes energy and never gives it,
gravity is not half of what it was, a motor is not dead. What a hand does cannot be explained so.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy.linalg import cholesky, solve_triangular
from scipy.optimize import lsq_linear

from leo_diffmodel.outside.flow import Flow, rotors
from leo_diffmodel.outside.samples import Array, reweighted
from leo_diffmodel.outside.settings import OUTSIDE
from leo_sim.model import Model

ANY = np.inf


@dataclass(frozen=True)
class Law:
    """One ordinary effect: its torque for a unit of it (N,), its limits, is it friction?"""

    torque: Array
    low: float
    high: float
    takes: bool = False


@dataclass(frozen=True)
class Ordinary:
    """The torque at one joint, explained as far as ordinary effects can."""

    rest: Array  # what is left over [N m, N], shape (N,)
    friction: Array  # of the effects that take energy [N m, N], shape (N,)


def explained(flow: Flow, j: int, fitted: Array, laws: Sequence[Law]) -> Ordinary:
    """The torque that the model lacks at joint j, by laws fitted to those instants (N,)."""
    columns = np.stack([law.torque for law in laws], axis=1)
    size = np.maximum(np.sqrt((columns[fitted] ** 2).mean(axis=0)), 1e-12)
    bounds = np.array([(law.low, law.high) for law in laws]).T * size
    amounts = _within(bounds, columns[fitted] / size, flow.missing[fitted, j])
    parts = columns / size * amounts
    taking = np.array([law.takes for law in laws])
    return Ordinary(flow.missing[:, j] - parts.sum(axis=1), parts[:, taking].sum(axis=1))


def follows(flow: Flow, j: int) -> bool:
    """Whether a motor does nothing of its own: its torque follows from where its joint is.

    It is off, or carries the weight, or holds against a hand. A motor that moves its joint has
    friction to overcome, and something else to do.
    """
    moving = flow.moving[:, j] > 0.5
    q, motor = flow.q[moving, j], flow.motor[moving, j]
    columns = np.stack([np.ones_like(q), q, np.sin(q), np.cos(q), flow.load[moving, j]], axis=1)
    own = motor - columns @ np.linalg.lstsq(columns, motor, rcond=1e-9)[0]
    return bool(np.square(own).sum() <= OUTSIDE.own_will**2 * np.square(motor).sum())


def strongest_wave(time: Array, rest: Array, fitted: Array) -> list[Law]:
    """A sine and a cosine of the frequency that is strongest in the rest (N,)."""
    t, y = time[fitted], rest[fitted]
    span = max(float(np.ptp(t)), 1e-9)
    about = _coarsest((t - t.min()) / span, y - y.mean(), 2.0 + OUTSIDE.wave_hertz * span)
    cycles = about + OUTSIDE.wave_coarse * np.linspace(-1, 1, 21)
    waves = np.exp(2j * np.pi / span * cycles[:, None] * t)
    best = float(cycles[int(np.argmax(np.abs(waves @ (y - y.mean()))))])
    phase = 2 * np.pi * best / span * time
    return [Law(np.sin(phase), -ANY, ANY), Law(np.cos(phase), -ANY, ANY)]


def _coarsest(t: Array, y: Array, most: float) -> float:
    """The cycles from t = 0 to 1, to a quarter, that are strongest in y (N,); 1 to `most`.

    In bins of time: of a pause of years the fastest are left out.
    """
    bins = int(min(OUTSIDE.wave_bins_per_cycle * most, OUTSIDE.wave_bins))
    binned = np.bincount(np.minimum((bins * t).astype(int), bins - 1), y, bins)
    coarse = OUTSIDE.wave_coarse
    strength = np.abs(np.fft.rfft(binned, round(bins / coarse)))
    most = min(most, bins / OUTSIDE.wave_bins_per_cycle)
    first, last = round(1 / coarse), round(most / coarse)
    return coarse * (first + int(np.argmax(strength[first : last + 1])))


def _within(bounds: Array, columns: Array, y: Array) -> Array:
    """Amounts within bounds that fit most instants, whatever the others do."""
    low, high = np.minimum(bounds[0], -1e-12), np.maximum(bounds[1], 1e-12)
    held = OUTSIDE.ridge**2 * len(y) * np.eye(columns.shape[1])

    def solve(weight: Array) -> Array:
        weighted = columns.T * weight
        upper = cholesky(weighted @ columns + held)
        right = solve_triangular(upper, weighted @ y, trans='T')
        return np.asarray(lsq_linear(upper, right, (low, high), method='bvls').x)

    return reweighted(solve, columns, y, 1e-9 * float(np.abs(y).max()) + 1e-15)[0]


def ordinary(flow: Flow, j: int) -> list[Law]:
    """The ordinary effects at joint j and their limits, but for its motor's strength."""
    own = float(np.quantile(flow.own[:, j], 0.9))
    steep = OUTSIDE.spring * float(np.abs(flow.load[:, j]).max())
    laws = [
        *_masses(flow, j),
        *_friction(flow, j),
        *_motor(flow, j),
        Law(np.ones(len(flow.time)), -OUTSIDE.tilt * own, OUTSIDE.tilt * own),
        Law(-(flow.q[:, j] - np.median(flow.q[:, j])), 0.0, steep or ANY),
    ]
    return [law for law in laws if np.abs(law.torque).max() > OUTSIDE.smallest * own]


def _masses(flow: Flow, j: int) -> list[Law]:
    """Other links, payloads, rotors, encoders that are off and a base that is tilted."""
    torque, least, most = flow.motion.masses
    weights = [Law(-x, a, b) for x, a, b in zip(torque[:, j].T, least, most, strict=True)]
    tilted = [Law(x, -OUTSIDE.tilt, OUTSIDE.tilt) for x in flow.motion.turned[:, j].T]
    least_rotor = OUTSIDE.lighter * rotors(flow.motion.model)[j]
    return [*weights, *tilted, Law(-flow.ddq[:, j], least_rotor, ANY)]


def _friction(flow: Flow, j: int) -> list[Law]:
    """What takes energy; less than nothing only as far as the model itself has friction."""
    viscous, dry = _model_friction(flow.motion.model, j)
    least = {'viscous': -viscous, 'dry': -dry}
    laws = [Law(x, least.get(name, 0.0), ANY, True) for name, x in losses(flow, j).items()]
    return [*laws, Law(-flow.dq[:, j] * flow.enabled[:, j], -viscous, ANY, True)]


def losses(flow: Flow, j: int) -> dict[str, Array]:
    """Torques of what takes energy at joint j, for a unit of each (N,)."""
    dq, sign, load, motor = (x[:, j] for x in (flow.dq, flow.sign, flow.load, flow.motor))
    return {
        'viscous': -dq,
        'dry': -sign,
        'drag': -dq * np.abs(dq),
        'by load': -sign * np.abs(load),
        'by motor': -sign * np.abs(motor),
    }


def _model_friction(model: Model, j: int) -> tuple[float, float]:
    """Viscous [N m s/rad] and dry [N m] friction of the model at joint j, back-EMF included."""
    zero, fast = np.zeros((2, len(model.robot.joint_names))), 1e-3
    u, dq = np.zeros((2, len(model.robot.actuators))), zero.copy()
    dq[1, j] = fast
    load = zero if model.laws.needs_load else None
    given = model.laws.torques(zero, dq, dq, u, np.ones_like(u), load)
    still, moved = np.broadcast_to(given.motor + given.joint, zero.shape)[:, j]
    dry = zero if given.level is None else np.broadcast_to(given.level, zero.shape)
    return max(0.0, float(still - moved) / fast), float(dry[0, j])


def _motor(flow: Flow, j: int) -> list[Law]:
    """A limit, a dead band, an input that acts later."""
    motor = flow.motor[:, j]
    top = float(np.abs(motor).max())
    if top < 1e-12:
        return []
    late = [Law(past - motor, OUTSIDE.earlier, 1.0) for past in flow.before[..., j].T]
    limit, dead = OUTSIDE.motor_limit * top, OUTSIDE.dead_band * top
    over = motor - np.clip(motor, -limit, limit)
    band = np.clip(motor, -dead, dead)
    return [Law(-over, 0.0, 1.0), Law(-band, 0.0, 1.0), *late]
