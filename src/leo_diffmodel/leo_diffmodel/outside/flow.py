# SPDX-License-Identifier: Apache-2.0
"""What a robot did along a recording, and the torque that its model lacks, by inverse dynamics.

Torques are means over short stretches under a bell of weights. A difference of rates under the
same bell is the mean acceleration exactly, whatever the input did meanwhile, so that steps of the
input leave nothing over.
"""

from dataclasses import dataclass

import numpy as np
from numpy.lib.stride_tricks import sliding_window_view

from leo_diffmodel.bags.held import mean_held
from leo_diffmodel.bags.recording import Episode, Recording
from leo_diffmodel.outside.masses import Motion
from leo_diffmodel.outside.samples import Array, integral, noise, THIRD
from leo_diffmodel.outside.settings import OUTSIDE
from leo_sim.laws.laws import Memory
from leo_sim.model import Model


@dataclass(frozen=True)
class Flow:
    """N instants of one recording, J joints."""

    time: Array  # since the first state of the recording [s], shape (N,)
    episode: Array  # number of the episode, shape (N,)
    q: Array  # angles [rad, m], shape (N, J)
    dq: Array  # rates [rad/s, m/s], shape (N, J)
    ddq: Array  # accelerations [rad/s2, m/s2], shape (N, J)
    missing: Array  # torque that the motion takes less what the model gives [N m, N], shape (N, J)
    motor: Array  # torque of the motors by the model, without back-EMF [N m, N], shape (N, J)
    before: Array  # the same some tens of milliseconds earlier, shape (N, D, J)
    load: Array  # torque of gravity by the model [N m, N], shape (N, J)
    turning: Array  # what the joint's own acceleration takes [N m, N], shape (N, J)
    sign: Array  # -1 to 1, mean direction of motion, shape (N, J)
    moving: Array
    """Share of the stretch in which the joint moves, shape (N, J); 0 if its angle stays."""
    enabled: Array  # share with the motor on, shape (N, J); 0 without a motor
    bell: float  # length of the stretches that torques are means over [s]
    motion: Motion  # the same angles, rates and accelerations, with the model

    def joint(self, j: int) -> str:
        return self.motion.model.robot.joint_names[j]

    def unit(self, j: int) -> str:
        """Of a torque at joint j."""
        return 'N' if self.joint(j) in self.motion.model.robot.slides else 'N m'

    @property
    def own(self) -> Array:
        """The largest torque at work at each instant and joint [N m, N], shape (N, J)."""
        return np.maximum(np.maximum(np.abs(self.motor), np.abs(self.load)), np.abs(self.turning))


def flow(recording: Recording, model: Model) -> Flow | None:
    """The flow of a recording whose rates are right.

    None where no episode holds a bell, and of a robot on the ground unless its base is held.
    """
    if model.robot.contacts and not recording.held:
        return None
    step, still = recording.state_period, still_rates(recording)
    bell = max(OUTSIDE.bell_seconds, OUTSIDE.bell_least_intervals * step)
    grid = max(step, bell / OUTSIDE.bell_most_intervals)
    episodes = enumerate(recording.episodes)
    parts = [p for i, e in episodes if (p := _episode(e, i, model, grid, bell, still))]
    if not parts:
        return None
    whole = {name: np.concatenate([part[name] for part in parts]) for name in parts[0]}
    return Flow(**whole, bell=bell, motion=Motion(model, whole['q'], whole['dq'], whole['ddq']))


def rotors(model: Model) -> Array:
    """Inertia of the rotors [kg m2, kg], shape (J,)."""
    inertia = np.asarray(model.laws.rotor_inertia, dtype=float).reshape(-1)
    return np.broadcast_to(inertia, len(model.robot.joint_names))


def still_rates(recording: Recording) -> Array:
    """Rate below which a joint may stand, shape (J,): three times the noise of the rate."""
    rates = [e.dq for e in recording.episodes]
    fast = np.quantile(np.abs(np.concatenate(rates)), 0.95, axis=0)
    rough = np.array([noise([dq[:, j] for dq in rates]) for j in range(len(recording.joints))])
    moving = np.maximum(OUTSIDE.still_sigmas * rough, OUTSIDE.still_share * fast)
    return np.asarray(np.maximum(moving, OUTSIDE.least_still))


def _episode(
    e: Episode, number: int, model: Model, grid: float, bell: float, still: Array
) -> dict[str, Array]:
    """What a flow has of one episode; empty where it holds no bell."""
    count = int(e.seconds / grid + 1e-6)
    wide = max(2, round(bell / grid))
    weights = (1 - ((np.arange(wide) + 0.5) / wide * 2 - 1) ** 2) ** 2
    weights = weights / weights.sum()
    if count < len(weights) + 1:
        return {}
    nodes = e.t[0] + grid * np.arange(count + 1)
    raw = _intervals(e, model, nodes, grid, weights, still)
    raw['time'] = 0.5 * (nodes[1:] + nodes[:-1])
    every = max(1, len(weights) // OUTSIDE.per_bell)

    def under_bells(values: Array) -> Array:
        """One after the other, inside the episode, along the last axis."""
        return sliding_window_view(values, len(weights), axis=0)[::every]

    smooth = {name: under_bells(values) @ weights for name, values in raw.items()}
    turned = np.ptp(under_bells(raw['q']), axis=-1)
    smooth['moving'] *= turned > OUTSIDE.turned * still * bell
    return {**smooth, 'episode': np.full(len(turned), number)}


def _intervals(
    e: Episode, model: Model, nodes: Array, grid: float, weights: Array, still: Array
) -> dict[str, Array]:
    """What goes into a flow, for each interval of an even grid."""
    q, dq = _states(e, nodes, grid, weights)
    q, dq = model.laws.true_state(q, dq)
    middle, rate = 0.5 * (q[1:] + q[:-1]), 0.5 * (dq[1:] + dq[:-1])
    ddq = np.diff(dq, axis=0) / grid
    given, enabled = _at_motors(model, e), e.enabled.astype(float)

    def acting(late: float) -> tuple[Array, Array]:
        """Inputs and enabled motors, where they act so much later than the model says."""
        t = e.t + late
        return mean_held(t, given, nodes), mean_held(t, enabled, nodes)

    u, on = acting(0.0)
    enabled_joints = np.zeros_like(ddq)
    enabled_joints[:, list(model.robot.actuated)] = on
    sign = np.clip(rate / still, -1, 1)
    held = _held(model, middle, rate, u, on, sign)
    mass, bias = model.rigid.mass_and_bias(middle, rate)
    load = model.rigid.load(middle)
    inertial = (mass + np.diag(rotors(model))) * ddq[:, None, :]
    return {
        'q': middle,
        'dq': rate,
        'ddq': ddq,
        'missing': inertial.sum(axis=-1) + bias - held,
        'motor': _motor(model, u, on, middle),
        'load': load,
        'turning': np.diagonal(inertial, axis1=1, axis2=2),
        'sign': sign,
        'moving': (np.abs(rate) > still).astype(float),
        'enabled': enabled_joints,
        'before': np.stack([_motor(model, *acting(d), middle) for d in OUTSIDE.delays], axis=1),
    }


def _held(model: Model, q: Array, dq: Array, u: Array, on: Array, sign: Array) -> Array:
    load = model.rigid.load(q) if model.laws.needs_load else None
    given = model.laws.torques(q, dq, dq, u, on, load)
    friction = 0.0 if given.level is None else given.level * sign
    return np.asarray(given.motor + given.joint - friction)


def _motor(model: Model, u: Array, on: Array, q: Array) -> Array:
    still = np.zeros_like(q)
    load = still if model.laws.needs_load else None
    return np.broadcast_to(model.laws.torques(q, still, still, u, on, load).motor, q.shape)


def _at_motors(model: Model, e: Episode) -> Array:
    """What the command effects of the model make of the inputs, shape (T, A)."""
    if not model.laws.dynamic:
        return np.asarray(model.laws.command(e.inputs, None, {}, 0.0)[0])
    memory: Memory = {}
    out = []
    for u, h in zip(e.inputs, np.diff(e.t, append=2 * e.t[-1] - e.t[-2]), strict=True):
        reached, _, memory = model.laws.command(u[None], None, memory, float(h))
        out.append(reached[0])
    return np.array(out)


def _states(e: Episode, nodes: Array, grid: float, weights: Array) -> tuple[Array, Array]:
    """Angles and rates at the nodes; rates from both sensors, as much from each as it is worth."""
    q = np.stack([np.interp(nodes, e.t, x) for x in e.q.T], axis=1)
    dq = _box(e.t, e.dq, nodes, grid)
    slope = np.gradient(q, grid, axis=0)
    own, other = _noise(e.dq), _noise(e.q)
    thinned = np.sqrt(max(1.0, grid / e.period))
    bell = np.diff(weights, prepend=0, append=0)
    of_rate = own / thinned * np.sqrt((bell**2).sum())
    of_angle = other / grid * np.sqrt((np.convolve(bell, [0.5, 0, -0.5]) ** 2).sum())
    share = of_angle**2 / np.maximum(of_angle**2 + of_rate**2, 1e-30)
    return q, share * dq + (1 - share) * slope


def _noise(values: Array) -> Array:
    rough = np.diff(values, 3, axis=0)
    if not len(rough):
        return np.full(values.shape[1], 1e-12)
    small = np.sort(rough**2, axis=0)[: max(1, int(0.8 * len(rough)))]
    return np.asarray(np.sqrt(small.mean(axis=0) / THIRD) + 1e-12)


def _box(t: Array, values: Array, nodes: Array, width: float) -> Array:
    """Means over `width` [s] about the nodes, of values on straight lines between samples."""
    if width < 1.5 * float(np.median(np.diff(t))):
        return np.stack([np.interp(nodes, t, x) for x in values.T], axis=1)
    area = integral(t, values)
    low, high = (np.clip(nodes + s * width / 2, t[0], t[-1]) for s in (-1, 1))
    sums = [np.interp(high, t, a) - np.interp(low, t, a) for a in area.T]
    return np.stack(sums, axis=1) / (high - low)[:, None]
