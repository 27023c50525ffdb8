# SPDX-License-Identifier: Apache-2.0
"""How much of the torque a model lacks ordinary effects can give: friction, masses, gains, lags.

Each may be only as large as it is on real robots: friction takes energy and never gives it,
gravity is not half of what it was, a motor is not dead. What a hand does cannot be explained so.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy.optimize import lsq_linear

from leo_diffmodel.outside.flow import Flow
from leo_sim.model import Model

Array = np.ndarray
ROUNDS = 12
HUBER = 1.5
MOST_HERTZ, COARSE = 6.0, 0.25
BINS_PER_CYCLE, MOST_BINS = 4, 2**20
ANY = np.inf
WEAKER = -0.4
"""Least change of a motor's torque, as a share of it. There is no most: as guessed, or in another
unit, it may be many times too weak, and what runs as it says is run by it."""
LIGHTER, HEAVIER, TILT, SPRING = -0.3, 2.0, 0.25, 0.3
"""Least and most change of a mass, as a share of it; torque across gravity, or the same always,
in the weight or in what is usually at work; stiffness of a spring, in the weight per radian."""


@dataclass(frozen=True)
class Law:
    """One ordinary effect: its torque for a unit of it (N,), its limits, is it friction?"""

    torque: Array
    low: float
    high: float
    takes: bool = False


@dataclass(frozen=True)
class Ordinary:
    """The torque at one joint, explained as far as ordinary effects can.

    Attributes:
        rest: what is left over [N m, N], shape (N,).
        friction: of the effects that take energy [N m, N], shape (N,).
    """

    rest: Array
    friction: Array


def explained(
    flow: Flow, model: Model, j: int, fitted: Array, more: Sequence[Law] = ()
) -> Ordinary:
    """Explain the torque that the model lacks at joint j.

    Args:
        flow: of one recording.
        model: its model.
        j: the joint.
        fitted: the instants that are fitted (N,); those of a joint that stands tell nothing.
        more: laws beside the ordinary ones.
    """
    laws = [*ordinary(flow, model, j), *more]
    columns = np.stack([law.torque for law in laws], axis=1)
    size = np.maximum(np.sqrt((columns[fitted] ** 2).mean(axis=0)), 1e-12)
    bounds = np.array([(law.low, law.high) for law in laws]).T * size
    amounts = _robust(columns[fitted] / size, flow.missing[fitted, j], bounds)
    parts = columns / size * amounts
    taking = np.array([law.takes for law in laws])
    return Ordinary(flow.missing[:, j] - parts.sum(axis=1), parts[:, taking].sum(axis=1))


def strongest_wave(time: Array, rest: Array, fitted: Array) -> list[Law]:
    """A sine and a cosine of the frequency that is strongest in the rest (N,)."""
    t, y = time[fitted], rest[fitted]
    span = max(float(np.ptp(t)), 1e-9)
    about = _coarsest((t - t.min()) / span, y - y.mean(), 2.0 + MOST_HERTZ * span)
    cycles = about + COARSE * np.linspace(-1, 1, 21)
    waves = np.exp(2j * np.pi / span * cycles[:, None] * t)
    best = float(cycles[int(np.argmax(np.abs(waves @ (y - y.mean()))))])
    phase = 2 * np.pi * best / span * time
    return [Law(np.sin(phase), -ANY, ANY), Law(np.cos(phase), -ANY, ANY)]


def _coarsest(t: Array, y: Array, most: float) -> float:
    """The cycles from t = 0 to 1, to `COARSE`, that are strongest in y (N,); 1 to `most`.

    In bins of time, so that a pause of years costs no more: then the fastest are left out.
    """
    bins = int(min(BINS_PER_CYCLE * most, MOST_BINS))
    binned = np.bincount(np.minimum((bins * t).astype(int), bins - 1), y, bins)
    strength = np.abs(np.fft.rfft(binned, round(bins / COARSE)))
    first, last = round(1 / COARSE), round(min(most, bins / BINS_PER_CYCLE) / COARSE)
    return COARSE * (first + int(np.argmax(strength[first : last + 1])))


def _robust(columns: Array, y: Array, bounds: Array) -> Array:
    """Amounts within bounds that fit most instants, whatever the others do."""
    weight, amounts = np.ones(len(y)), np.zeros(columns.shape[1])
    floor = 1e-9 * float(np.abs(y).max()) + 1e-15
    low, high = np.minimum(bounds[0], -1e-12), np.maximum(bounds[1], 1e-12)
    for _ in range(ROUNDS):
        root = np.sqrt(weight)[:, None]
        q, r = np.linalg.qr(columns * root)
        target = q.T @ (y * root[:, 0])
        amounts = lsq_linear(r, target, (low, high), method='bvls').x
        rest = np.abs(y - columns @ amounts)
        size = 1.4826 * float(np.median(rest)) + floor
        weight = np.minimum(1.0, (HUBER * size / np.maximum(rest, 1e-300)))
    return amounts


def ordinary(flow: Flow, model: Model, j: int) -> list[Law]:
    """The ordinary effects at joint j and their limits."""
    own = float(np.quantile(flow.own[:, j], 0.9))
    steep = SPRING * float(np.abs(flow.load[:, j]).max())
    return [
        *_gravity(flow, j),
        *_masses(flow, j),
        *_friction(flow, model, j),
        *_motor(flow, j),
        Law(np.ones(len(flow.time)), -TILT * own, TILT * own),
        Law(-(flow.q[:, j] - np.median(flow.q[:, j])), 0.0, steep or ANY),
    ]


def _gravity(flow: Flow, j: int) -> list[Law]:
    """Another payload, a tilted base or an encoder that is off, link by link."""
    angles = np.cumsum(flow.q, axis=1)
    waves = np.concatenate([np.sin(angles), np.cos(angles)], axis=1)
    load, joints = flow.load[:, j], flow.q.shape[1]
    amounts = np.linalg.lstsq(waves, load, rcond=1e-6)[0]
    if np.abs(waves @ amounts - load).max() > 0.05 * np.abs(load).max() + 1e-12:
        return [Law(load, LIGHTER, HEAVIER)]
    out = []
    for k in range(joints):
        a, b = amounts[k], amounts[joints + k]
        pull = a * waves[:, k] + b * waves[:, joints + k]
        across = a * waves[:, joints + k] - b * waves[:, k]
        out += [Law(pull, LIGHTER, HEAVIER), Law(across, -TILT, TILT)]
    return out


def _masses(flow: Flow, j: int) -> list[Law]:
    """Other inertias of the links and rotors."""
    out = [Law(-flow.swing[:, j], LIGHTER, HEAVIER)]
    for k in range(flow.q.shape[1]):
        mine = k == j
        out.append(Law(-flow.inertial[:, j, k], LIGHTER, HEAVIER))
        if flow.q.shape[1] > 1:
            largest = HEAVIER * _inertia(flow, j)
            low = 0.0 if mine else -largest
            out.append(Law(-flow.ddq[:, k], low, largest))
    return out


def _inertia(flow: Flow, j: int) -> float:
    """Typical inertia that joint j turns [kg m2, kg]."""
    ddq = flow.ddq[:, j]
    return float(np.abs(flow.inertial[:, j, j]).sum() / max(float(np.abs(ddq).sum()), 1e-12))


def _friction(flow: Flow, model: Model, j: int) -> list[Law]:
    """What takes energy; less than nothing only as far as the model itself has friction."""
    dq, sign, load, motor = (x[:, j] for x in (flow.dq, flow.sign, flow.load, flow.motor))
    viscous, dry = _model_friction(flow, model, j)
    return [
        Law(-dq, -viscous, ANY, True),
        Law(-sign, -dry, ANY, True),
        Law(-dq * np.abs(dq), 0.0, ANY, True),
        Law(-sign * np.abs(load), 0.0, ANY, True),
        Law(-sign * np.abs(motor), 0.0, ANY, True),
        Law(-dq * flow.enabled[:, j], -viscous, ANY, True),
    ]


def _model_friction(flow: Flow, model: Model, j: int) -> tuple[float, float]:
    """Viscous [N m s/rad] and dry [N m] friction of the model at joint j, back-EMF included."""
    joints, motors = flow.q.shape[1], len(model.robot.actuators)
    zero, u, fast = np.zeros((1, joints)), np.zeros((1, motors)), 1e-3
    load = zero if model.laws.needs_load else None
    moved = fast * np.eye(joints)[j][None]
    at = [model.laws.torques(zero, w, w, u, np.ones((1, motors)), load) for w in (zero, moved)]
    given = [np.broadcast_to(x.motor + x.joint, (1, joints))[0, j] for x in at]
    dry = at[0].level
    return (
        max(0.0, float(given[0] - given[1]) / fast),
        0.0 if dry is None else float(np.broadcast_to(dry, (1, joints))[0, j]),
    )


def _motor(flow: Flow, j: int) -> list[Law]:
    """A weaker or stronger motor, a limit, a dead band, an input that acts later."""
    motor = flow.motor[:, j]
    top = float(np.abs(motor).max())
    if top < 1e-12:
        return []
    late = [Law(past[:, j] - motor, -0.3, 1.0) for i, past in enumerate(flow.before)]
    over = motor - np.clip(motor, -0.6 * top, 0.6 * top)
    band = np.clip(motor, -0.15 * top, 0.15 * top)
    return [Law(motor, WEAKER, ANY), Law(-over, 0.0, 1.0), Law(-band, 0.0, 1.0), *late]
