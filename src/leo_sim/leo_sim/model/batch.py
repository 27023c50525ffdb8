# SPDX-License-Identifier: Apache-2.0
"""The physics of a model over many windows, and many parameter values, at once."""

from typing import Any, NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from leo_sim.common.broadcasting import Array, paired
from leo_sim.dynamics import whole_windows
from leo_sim.dynamics.substep import DRIVE, Period, rested, slowing, substeps
from leo_sim.dynamics.window_input import Held
from leo_sim.laws.laws import HELD, Memory, TIME
from leo_sim.model.model import Model
from leo_sim.model.window_shares import Batch, shares

RECENT = 0.2  # s: how long ago is enough for play and sensors to settle


class History(NamedTuple):
    """The H samples before the windows, to warm up delay, lag and play."""

    q: Any  # measured angles and rates at the start of each interval, (..., W, H, J)
    dq: Any
    inputs: Any  # held over each interval, (..., W, H, A)
    enabled: Any  # booleans (..., W, H, A) or None
    dt: Any  # s, (W, H)


def rollout(
    model: Model,
    q0: ArrayLike,
    dq0: ArrayLike,
    inputs: ArrayLike,
    dt: ArrayLike,
    enabled: np.ndarray | None = None,
    history: History | tuple[Any, ...] | None = None,
    push: Array | None = None,
    start: ArrayLike = 0.0,
    held: ArrayLike | None = None,
    near: bool | whole_windows.Along = False,
) -> tuple[Any, Any]:
    """Measured angles and rates along open-loop windows.

    The same numbers as `Model.step` over each interval, to rounding. Without a history the
    windows start at rest: inputs were 0 before.

    Args:
        model: Its effect parameters and constants may be arrays (S, 1, 1).
        q0: Measured angles at the start, (..., W, J).
        dq0: Measured rates at the start, (..., W, J).
        inputs: V, N m or rad held from sample k to k + 1, (..., W, K, A).
        dt: s, (W, K), or a float.
        enabled: Booleans (..., W, K, A), or None for all motors on.
        history: The samples before.
        push: Extra torque on the links held over each interval, N m, (..., W, K, J).
        start: Time from the start of the run to the start of each window s, (W,), or a float.
        held: Windows in which the base does not move, booleans (W,); None where the model says.
        near: The states of a window differ little, as for a derivative: where whole windows are
            compiled, all but the first are found by what is linear about that, and sooner. An
            `Along` keeps the first one for the next call with the same start states and inputs.

    Returns:
        q and dq of the measured state, (..., W, K + 1, J); (S, W, K + 1, J) for a scan.
    """
    inputs = np.asarray(inputs, dtype=float)
    periods = np.broadcast_to(np.asarray(dt, dtype=float), inputs.shape[-3:-1])
    begun = np.broadcast_to(np.asarray(start, dtype=float), inputs.shape[-3:-2])
    q, dq = np.asarray(q0, dtype=float), np.asarray(dq0, dtype=float)
    past = None if history is None else History(*history)
    still = _held(model, held, inputs.shape[-3])
    batch = Batch(q, dq, inputs, periods, enabled, past, push, begun, still)
    if not model.robot.contacts:
        return _rolled(model, batch, near)
    parts = shares(lambda part: _rolled(model, part), batch)
    angles, rates = zip(*parts, strict=True)
    return np.concatenate(angles, axis=-3), np.concatenate(rates, axis=-3)


def _held(model: Model, held: ArrayLike | None, count: int) -> Any:
    """Which windows have a base that does not move, 1 or 0 (W,); None where none has."""
    if held is None:
        held = model.held
    held = np.broadcast_to(np.asarray(held, dtype=float), (count,))
    return held if held.any() else None


@np.errstate(all='ignore')
def _rolled(
    model: Model, batch: Batch, near: bool | whole_windows.Along = False
) -> tuple[Any, Any]:
    history, inputs, periods, push = batch.history, batch.inputs, batch.periods, batch.push
    laws = model.laws if history is None else model.reading_laws
    memory: Memory = {TIME: batch.start[..., None]}
    if batch.held is not None:
        memory = {**memory, HELD: batch.held}
    recalled: Memory = {}
    if history is not None:
        rates = laws.true_state(batch.q0, batch.dq0)[1]
        memory, recalled = warmed(model.at(batch.start[:, None]), history, rates, memory)
    q, dq, settled = laws.sensors.true_state(batch.q0, batch.dq0, recalled)
    memory = {**memory, **settled}
    if whole_windows.possible(laws, q, inputs):
        given = Held(inputs, periods, batch.enabled, push, memory)
        step, tree = model.integration_step, model.at(_amid(batch)[:, None]).spatial
        read = whole_windows.run(laws, tree, q, dq, given, step, near)
        return np.moveaxis(read[0], 0, -2), np.moveaxis(read[1], 0, -2)
    measured = [laws.sense(q, dq, memory)]
    for k, time in enumerate(_amid(batch)):
        h, count = _substep(periods[:, k], model.integration_step)
        pushed = 0.0 if push is None else push[..., k, :]
        period = Period(inputs[..., k, :], _on(batch.enabled, k), h, count, pushed)
        then = model.at(time).rigid
        q, dq, memory = model.integrate(laws, then, q, dq, memory, period)
        measured.append(laws.sense(q, dq, memory))
    angles, rates = (np.broadcast_arrays(*each) for each in zip(*measured, strict=True))
    return np.stack(angles, axis=-2), np.stack(rates, axis=-2)


def _amid(batch: Batch) -> Array:
    """The time amid each sample period since the run began, s, (K, W, 1)."""
    ends = batch.start[:, None] + np.cumsum(batch.periods, axis=-1)
    return np.asarray((ends - 0.5 * batch.periods).T[..., None])


def warmed(model: Model, history: History, dq: Array, memory: Memory) -> tuple[Memory, Memory]:
    """What the effects remember after the history, and what the sensors recall of the motion.

    The joints are held to the states of the history; dq are true rates at the start of the
    windows, (..., W, J), and the memory is one where nothing went before, with the time there.
    """
    laws = model.reading_laws
    recalled: Memory = {}
    if not (laws.dynamic or laws.recalls or laws.sensors.dynamic) and laws.gap is None:
        return memory, recalled
    inputs = np.asarray(history.inputs, dtype=float)
    periods = np.broadcast_to(np.asarray(history.dt, dtype=float), inputs.shape[-3:-1])
    readings = (np.moveaxis(np.asarray(x, float), -2, 0) for x in (history.q, history.dq))
    states = list(zip(*readings, strict=True))
    true = [laws.true_state(*state) for state in states]
    rates = [state[1] for state in true] + [dq]
    ahead = np.cumsum(periods[:, ::-1], axis=-1)[:, ::-1]  # s, from each sample to the window
    recent = np.asarray((ahead - periods < RECENT).any(axis=0))
    late = int(np.argmax(recent))
    first = 0 if laws.dynamic or laws.recalls else late
    memory = {**memory, **laws.resting(*true[0]), TIME: memory[TIME] - ahead[:, first, None]}
    memory = rested(laws, *true[late], memory)
    for k, state in enumerate(states[first:], first):
        moved = laws.recalls or (laws.gap is not None and recent[k])
        h, count = _substep(periods[:, k], model.integration_step)
        held = Period(inputs[..., k, :], _on(history.enabled, k), h, count)
        if laws.sensors.dynamic and recent[k]:
            faster = _faster(model, state, recalled, memory, held)
            recalled = laws.sensors.recall(recalled, faster, h * count)
        if not moved:  # commands need no substeps
            h, count = h * count, 1
        for i in range(count):
            if i == 0 or laws.dynamic:
                u, on, memory = laws.command(*held[:2], memory, h)
            share = (i + 1) / count
            rate = (1 - share) * rates[k] + share * rates[k + 1]
            if laws.recalls:
                memory = laws.remember(true[k][0], rate, memory, h)
            if laws.gap is not None and recent[k]:
                angles = true[k][0] + (i + 0.5) * h * rate
                memory = _play(model, memory, angles, rate, Period(u, on, h, 1))
            memory = {**memory, TIME: memory[TIME] + h}
    return memory, recalled


def _faster(
    model: Model, state: tuple[Any, Any], recalled: Memory, memory: Memory, held: Period
) -> Any:
    """Mean acceleration of the joints over one interval from a reading."""
    laws = model.reading_laws
    q, dq, _ = laws.sensors.true_state(*state, recalled)
    after = model.integrate(laws, model.rigid, q, dq, memory, held)[1]
    return (after - dq) / np.maximum(held.h * held.steps, 1e-12)


def _play(model: Model, memory: Memory, q: Array, dq: Array, motors: Period) -> Memory:
    """The motor sides after h s while the joints move at given rates."""
    laws, (u, enabled, h, *_) = model.reading_laws, motors
    offset, speed = memory[DRIVE]
    drag = slowing(laws, model.rigid, q, dq, memory, u, enabled)
    load = model.rigid.load(q) if laws.needs_load else None
    torque = laws.torques(q, dq, speed, u, enabled, load, memory).motor
    free = speed + (h * torque) / (laws.rotor_inertia + 0.5 * h * drag.motor)
    step, half = np.maximum(h, 1e-12), 0.5 * np.asarray(laws.gap)
    slip = np.clip(free - dq, (-half - offset) / step, (half - offset) / step)
    return {**memory, DRIVE: paired(offset + h * slip, dq + slip)}


def _substep(periods: Array, longest: float) -> tuple[Any, int]:
    """Substep length (a float, or (W, 1) for uneven periods) and count for one interval."""
    most = float(periods.max())
    count = substeps(most, longest)
    if float(periods.min()) == most:
        return most / count, count
    return periods[:, None] / count, count


def _on(enabled: np.ndarray | None, k: int) -> Any:
    """Which motors are on in interval k; None for all."""
    if enabled is None:
        return None
    on = np.asarray(enabled, dtype=bool)[..., k, :]
    return None if on.all() else on
