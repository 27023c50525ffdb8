# SPDX-License-Identifier: Apache-2.0
"""Transitions of one control step, as the robot made them and as the model would have."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from dataclasses import dataclass, fields, replace
from typing import TYPE_CHECKING

import numpy as np

from leo_diffmodel.compare.windows import Array
from leo_msgs_py.errors import UserError

if TYPE_CHECKING:
    from leo_diffmodel.bags.recording import Episode, Recording, Recordings
    from leo_sim.description.robot import Robot
    from leo_sim.model import Model

LATE = 0.1  # a step whose length differs from the control period by a larger share is left out


@dataclass(frozen=True)
class Transitions:
    """N control steps in time order: state, held input, next state measured and predicted."""

    q: Array  # before the step [rad], (N, J)
    dq: Array  # [rad/s], (N, J)
    inputs: Array  # held [V, N m or rad], (N, A)
    q_next: Array  # measured after it, (N, J)
    dq_next: Array
    q_model: Array  # predicted by the model, (N, J)
    dq_model: Array
    period: float  # length of every step [s]

    def __len__(self) -> int:
        return len(self.q)

    def part(self, rows: slice | Array) -> Transitions:
        arrays = {f.name: getattr(self, f.name)[rows] for f in fields(self) if f.name != 'period'}
        return replace(self, **arrays)


def transitions(
    recordings: Iterable[Recording], model: Model, limit: int | None = None
) -> Transitions:
    """The control steps of some recordings, the first `limit` of them, with the model's answer.

    UserError: not one step in which the motors were on and the input was held, or recordings of
    several control periods.
    """
    recordings = list(recordings)
    steps = [(r, [s for e in r.episodes for s in _steps(e, r.command_period)]) for r in recordings]
    rows = [row for _, found in steps for row in found]
    if not rows:
        names = ', '.join(str(r.path) for r in recordings) or 'no bag'
        raise UserError(
            f'{names}: no control step with a held input; record the robot while it is driven'
        )
    period = _period([r for r, found in steps if found])
    columns = zip(*rows[:limit], strict=True)
    q, dq, inputs, q_next, dq_next = (np.array(column) for column in columns)
    return predicted(Transitions(q, dq, inputs, q_next, dq_next, q_next, dq_next, period), model)


def _period(recordings: Recordings) -> float:
    """The control period of all [s], that of the first."""
    period = recordings[0].command_period
    for r in recordings:
        if abs(r.command_period - period) > LATE * period:
            raise UserError(
                f'{r.path}: commands every {r.command_period * 1e3:.4g} ms, in '
                f'{recordings[0].path} every {period * 1e3:.4g} ms; a difference model has steps '
                'of one length, give it bags of one control period'
            )
    return period


def predicted(steps: Transitions, model: Model) -> Transitions:
    from leo_sim.model.batch import rollout

    q, dq = rollout(model, steps.q, steps.dq, steps.inputs[:, None, :], steps.period)
    return replace(steps, q_model=q[:, 1], dq_model=dq[:, 1])


def _steps(episode: Episode, period: float) -> Iterator[tuple[Array, ...]]:
    """Steps of one control period within which the input did not change, motors on."""
    spacing = float(np.median(np.diff(episode.t)))
    stride = max(1, round(period / spacing))
    length = episode.t[stride:] - episode.t[:-stride]
    held = _held(episode, stride) & (np.abs(length - period) <= LATE * period)
    offset = max(range(stride), key=lambda o: int(held[o::stride].sum()))
    for k in np.flatnonzero(held[offset::stride]) * stride + offset:
        end = k + stride
        yield episode.q[k], episode.dq[k], episode.inputs[k], episode.q[end], episode.dq[end]


def _held(episode: Episode, stride: int) -> Array:
    held = np.ones(max(len(episode.t) - stride, 0), bool)
    for shift in range(stride):
        now = slice(shift, shift + len(held))
        held &= np.all(episode.enabled[now], axis=1)
        held &= np.all(np.isclose(episode.inputs[now], episode.inputs[: len(held)]), axis=1)
    return held


@dataclass(frozen=True)
class Layout:
    """Cos and sin of every continuous joint, the angle of every other one, then all rates."""

    continuous: tuple[bool, ...]  # whether each joint turns without end, length J
    planar: bool  # whether joint 0 is the base's horizontal slide, on which nothing depends
    actuators: int  # number of inputs A

    @property
    def states(self) -> int:
        return 2 * len(self.continuous) + sum(self.continuous)

    def state(self, q: Array, dq: Array) -> Array:
        """State vector (..., states) of joint angles and rates (..., J)."""
        turning = np.array(self.continuous)
        angles = q[..., turning]
        return np.concatenate([np.cos(angles), np.sin(angles), q[..., ~turning], dq], axis=-1)

    def network_input(self, q: Array, dq: Array, inputs: Array) -> Array:
        """State vector and input (..., states + A), the base's x left out of account."""
        if self.planar:
            q = q.copy()
            q[..., 0] = 0.0
        return np.concatenate([self.state(q, dq), inputs], axis=-1)

    def moved(self, q: Array, dq: Array, difference: Array) -> tuple[Array, Array]:
        """Joint angles and rates after adding `difference` (..., states) to their state vector.

        A continuous joint stays within half a turn of where it was.
        """
        turning, state = np.array(self.continuous), self.state(q, dq) + difference
        n, joints = int(turning.sum()), len(turning)
        wanted = np.arctan2(state[..., n : 2 * n], state[..., :n])
        moved = q.copy()
        moved[..., turning] += np.angle(np.exp(1j * (wanted - q[..., turning])))
        moved[..., ~turning] = state[..., 2 * n : n + joints]
        return moved, state[..., n + joints :]


def layout_of(robot: Robot) -> Layout:
    return Layout(
        continuous=tuple(j.kind == 'continuous' for j in robot.joints if j.independent),
        planar=robot.base == 'planar',
        actuators=len(robot.actuators),
    )


def channel_names(robot: Robot, form: str) -> tuple[str, ...]:
    """What each number of a correction is about, as `left_knee rate` or `left_knee torque`."""
    if form == 'torque':
        return tuple(f'{actuator.joint} torque' for actuator in robot.actuators)
    names, turning = robot.joint_names, layout_of(robot).continuous
    circling = [name for name, turns in zip(names, turning, strict=True) if turns]
    other = [name for name in names if name not in circling]
    angles = [f'{name} angle' for name in [*circling, *circling, *other]]
    return (*angles, *(f'{name} rate' for name in names))
