# SPDX-License-Identifier: Apache-2.0
"""Effects on what the encoders read."""

from typing import Any

import numpy as np

from leo_sim.common.broadcasting import Array, Numbers, paired
from leo_sim.common.compiled import compiled
from leo_sim.description.robot import Robot
from leo_sim.effects.base import Effect, Parameter, Reading, Values

TINY, SHORTEST = 1e-200, 1e-12  # s
NEWTON_STEPS = 6  # the error of one is squared in the next


class _Sensor(Effect):
    family = hook = 'sensor'


class EncoderOffset(_Sensor):
    """The measured angle is the true one + o."""

    name = 'encoder_offset'
    parameters = (Parameter('o', 'rad', role='amplitude'),)
    equation = 'q_read = q + o'
    looks_like = 'Gravity seems turned: the rest position is not where it should be.'
    confused_with = 'bias_torque over narrow angles; link_com x.'
    reveal = 'Hanging still, and slow motion over a full turn.'

    def sensor(self, p: Values, q: Array, dq: Array, memory: Any, dt: Numbers) -> Reading:
        return q + p['o'], dq, memory


class EncoderScale(_Sensor):
    """The measured angle and rate are the true ones x k."""

    name = 'encoder_scale'
    parameters = (Parameter('k', '', neutral=1.0, low=0.1, high=10.0, role='amplitude'),)
    equation = 'q_read = k q, w_read = k w'
    looks_like = 'Gravity repeats not once per measured turn; swings seem wider or narrower.'
    confused_with = 'link_mass, link_inertia and torque_scale together, over narrow angles.'
    reveal = 'Slow motion over a full turn or more.'
    rank = 20

    def sensor(self, p: Values, q: Array, dq: Array, memory: Any, dt: Numbers) -> Reading:
        return q * p['k'], dq * p['k'], memory


class EncoderEccentricity(_Sensor):
    """A magnet or disc off the axis: the reading swings by a sin q + b (cos q - 1) in each turn.

    It reads right at angle 0.
    """

    name = 'encoder_eccentricity'
    parameters = tuple(Parameter(n, 'rad', low=-0.5, high=0.5, role='amplitude') for n in 'ab')
    equation = 'q_read = q + a sin q + b (cos q - 1), w_read = w (1 + a cos q - b sin q)'
    looks_like = 'The joint seems to turn faster in one half of a turn than in the other.'
    confused_with = 'encoder_scale with encoder_offset, over narrow angles; link_com there.'
    reveal = 'Motion over full turns, fast and slow.'
    rank = 20

    def sensor(self, p: Values, q: Array, dq: Array, memory: Any, dt: Numbers) -> Reading:
        swing, slope = _eccentric(p, q)
        return q + swing, dq * slope, memory

    def unsensed(self, p: Values, q: Array, dq: Array, recalled: Any = None) -> Reading:
        true = q
        for _ in range(NEWTON_STEPS):
            swing, slope = _eccentric(p, true)
            true = true - (true + swing - q) / slope
        return true, dq / _eccentric(p, true)[1], None

    def in_words(self, p: Values, where: str, constants: Values) -> str:
        return f'an amplitude of {np.hypot(p["a"], p["b"]):.3g} rad'

    def places(self, robot: Robot) -> tuple[str, ...]:
        still = {*robot.base_joints, *robot.slides}
        return tuple(j for j in robot.joint_names if j not in still)


def _eccentric(p: Values, q: Array) -> tuple[Any, Any]:
    """What is added to an angle, and d q_read / d q."""
    sin, cos = np.sin(q), np.cos(q)
    return p['a'] * sin + p['b'] * (cos - 1.0), 1.0 + p['a'] * cos - p['b'] * sin


class VelocityLag(_Sensor):
    """The measured rate follows the true one as a first-order lag of time constant tau.

    Exact for a true rate that is straight over dt. The memory (2, ..., joints) holds the
    measured and the true rate.
    """

    name = 'velocity_lag'
    parameters = (Parameter('tau', 's', low=0.0, high=0.5, role='delay'),)
    equation = 'tau dw_read/dt = w - w_read'
    looks_like = 'The rate is not the derivative of the angle: it comes late and rounded.'
    confused_with = 'measurement_delay, which holds up the angle too.'
    reveal = 'Steps and fast square waves, sampled at 100 Hz or more.'
    dynamic = True
    of_rates = True
    rank = 10

    def sensor(self, p: Values, q: Array, dq: Array, memory: Any, dt: Numbers) -> Reading:
        if memory is None:
            return q, dq, np.stack([dq, dq])
        if not np.any(dt):
            return q, memory[0], memory
        read, before = memory
        decay, behind = _behind(p, dq - before, dt)
        read = dq - behind + (read - before) * decay
        return q, read, paired(read, dq)

    def readings(self, p: Values, q: Array, dq: Array, memory: Any, dt: Array) -> tuple[Any, Any]:
        decay, behind = _behind(p, np.diff(dq, axis=0), dt)
        first = np.zeros_like(dq[0]) if memory is None else memory[0] - memory[1]
        shape = np.broadcast_shapes(np.shape(first), behind.shape[1:])
        off = np.empty((len(dq), int(np.prod(shape))))
        off[0] = np.broadcast_to(first, shape).ravel()
        whole = len(behind), *shape
        flat = (np.broadcast_to(x, whole).reshape(len(behind), -1) for x in (decay, behind))
        _follow(off, *flat)
        return q, dq + off.reshape(-1, *shape)

    def recall(self, p: Values, recalled: Any, faster: Array, dt: Numbers) -> Any:
        """The lagged acceleration of the joints."""
        decay = np.exp(-dt / np.maximum(p['tau'], TINY))
        return faster if recalled is None else faster + (recalled - faster) * decay

    def unsensed(self, p: Values, q: Array, dq: Array, recalled: Any = None) -> Reading:
        """The true rate is ahead of the measured one by tau x the lagged acceleration."""
        true = dq + p['tau'] * (0.0 if recalled is None else recalled)
        return q, true, paired(dq, true)


def _behind(p: Values, gained: Array, dt: Numbers) -> tuple[Any, Any]:
    """What is left after dt s of what a reading was off by, and how far it falls behind anew."""
    tau = np.maximum(p['tau'], TINY)
    decay = np.exp(-dt / tau)
    return decay, tau * gained / np.maximum(dt, TINY) * (1.0 - decay)


@compiled
def _follow(off: Array, decay: Array, behind: Array) -> None:
    """Fill in by how much N readings differ from the truth, from the first, (N + 1, M)."""
    for n in range(len(decay)):
        off[n + 1] = off[n] * decay[n] - behind[n]


class MeasurementDelay(_Sensor):
    """The measured joint state, all of it, is the true one `delay` seconds ago.

    The memory (3, n, ..., joints) holds ages s, angles and rates of the last n states, newest
    first; between them the state is taken as straight, before the oldest as at rest there.
    """

    name = 'measurement_delay'
    parameters = (Parameter('delay', 's', low=0.0, high=0.5, role='delay'),)
    equation = 'q_read(t) = q(t - delay), w_read(t) = w(t - delay)'
    looks_like = 'Every answer to a change of the command comes late by the same time.'
    confused_with = 'command_delay of all joints (the same but for free motors); actuator_lag.'
    reveal = 'Steps and fast square waves, sampled at 100 Hz or more.'
    dynamic = True
    late = True
    undivided = True
    rank = 90

    def sensor(self, p: Values, q: Array, dq: Array, memory: Any, dt: Numbers) -> Reading:
        if memory is None or np.any(dt):
            memory = self._seen(q, dq, memory, dt, np.max(p['delay']))
        ages, angles, rates = np.moveaxis(memory, 1, -1)
        span = np.maximum(np.diff(ages), SHORTEST)
        share = np.clip((np.asarray(p['delay'])[..., None] - ages[..., :-1]) / span, 0.0, 1.0)
        return _back(angles, share), _back(rates, share), memory

    @staticmethod
    def _seen(q: Array, dq: Array, memory: Any, dt: Numbers, longest: float) -> Any:
        """The memory with the state of now, less what no delay up to `longest` reaches."""
        newest = np.stack(np.broadcast_arrays(0.0, q, dq))[:, None]
        if memory is None:
            return newest
        older = memory + np.array([1.0, 0.0, 0.0]).reshape(3, *[1] * (memory.ndim - 1)) * dt
        parts = np.broadcast_shapes(newest.shape[2:], older.shape[2:])
        memory = np.concatenate(
            [np.broadcast_to(part, (*part.shape[:2], *parts)) for part in (newest, older)], axis=1
        )
        ages = memory[0].reshape(memory.shape[1], -1).min(axis=1)
        return memory[:, : 1 + int(np.searchsorted(ages, longest))]


def _back(states: Array, share: Array) -> Array:
    """From the newest of the states (..., n) by shares (..., n - 1) of the steps to older ones."""
    steps = share * np.diff(states)
    newest = np.broadcast_to(states[..., :1], (*steps.shape[:-1], 1))
    return np.cumsum(np.concatenate([newest, steps], axis=-1), axis=-1)[..., -1]
