# SPDX-License-Identifier: Apache-2.0
"""Faults of single sensors: stuck, at their end, repeated, coarse, or no measurement at all."""

from collections.abc import Iterator, Sequence
from functools import partial

import numpy as np

from leo_diffmodel.bags.recording import Recording
from leo_diffmodel.compare.sizes import length_unit
from leo_diffmodel.faults.catalogue import FAULTS
from leo_diffmodel.faults.found import Found
from leo_diffmodel.faults.settings import LIMITS
from leo_diffmodel.outside.finding import ERROR, graded, WARNING
from leo_diffmodel.outside.frozen import frozen
from leo_diffmodel.outside.samples import resolution, spread
from leo_sim.description.robot import Robot

_found = partial(Found, evidence='sensor')


def sensor_faults(recording: Recording, robot: Robot) -> list[Found]:
    """What is wrong with single channels of a robot's recording."""
    out: list[Found] = []
    for j, joint in enumerate(recording.joints):
        if recording.input == 'position' and joint in recording.actuators:
            a = recording.actuators.index(joint)
            out += [*_goal(recording, j, a, joint), *_early(recording, j, a, joint)]
        if recording.rates == 'measured':
            out += [*_unsigned(recording, j, joint), *_repeated(recording, j, joint)]
        out += _coarse(recording, j, joint, length_unit(robot, joint))
    longest = {f.joint: _longest(recording, f) for f in out}
    return [*out, *(f for f in _frozen(recording) if f.value > longest.get(f.joint, 0.0))]


def _longest(recording: Recording, found: Found) -> float:
    """The longest stretch of one value that another fault, or chance repetition, explains [s]."""
    if found.code == 'goal_as_angle':
        return np.inf
    if found.code != 'repeated':
        return 0.0
    step = recording.steps
    runs = np.log(len(step)) / -np.log(min(found.value, 0.99))
    return LIMITS.chance * float(runs * np.median(step))


def _frozen(recording: Recording) -> Iterator[Found]:
    for joint, sensor, at_end, spans in frozen(recording):
        longest = max(b - a for a, b in spans)
        how = 'stays at its largest value' if at_end else 'stands still'
        lost = sum(b - a for a, b in spans)
        what = f'the {sensor} of {joint} {how} while the joint moves, {len(spans)} times, '
        what += f'{lost:.2f} s in all'
        name = 'clipped' if at_end and sensor == 'speed' else 'frozen'
        rates = (e.dq[:, recording.joints.index(joint)] for e in recording.episodes)
        top = max(float(np.abs(rate).max()) for rate in rates)
        value = top if name == 'clipped' else longest
        error = lost > LIMITS.most_lost * sum(e.seconds for e in recording.episodes)
        yield _found(name, graded(error), what, where=spans, joint=joint, value=value)


def _goal(recording: Recording, j: int, a: int, joint: str) -> Iterator[Found]:
    """Whether the angle is the goal of its row, or of the row before, where that moves."""
    same = moved = 0
    for e in recording.episodes:
        goal, q = e.inputs[:, a], e.q[:, j]
        near = np.minimum(np.abs(q[1:] - goal[1:]), np.abs(q[1:] - goal[:-1])) < LIMITS.goal_equal
        moves = np.abs(np.diff(goal)) > LIMITS.goal_equal
        same, moved = same + int(near[moves].sum()), moved + int(moves.sum())
    if moved >= LIMITS.fewest_goals and same > LIMITS.goal_share * moved:
        what = f'the angle of {joint} is its goal to the last digit, and no measurement'
        yield _found('goal_as_angle', ERROR, what, joint=joint, value=same / moved)


def _early(recording: Recording, j: int, a: int, joint: str) -> Iterator[Found]:
    """Whether the angle does in advance what its goal says later."""
    period = recording.state_period
    reach = round(LIMITS.reach / period)
    goals = [np.diff(e.inputs[:, a]) for e in recording.episodes]
    alike = _alike(goals, [np.diff(e.q[:, j]) for e in recording.episodes], reach)
    early, after = alike[:reach].max(initial=0.0), alike[reach:].max(initial=0.0)
    late = (int(np.argmax(alike)) - reach) * period
    low = FAULTS['goal_exchanged'].harmless[0]
    ahead = early > max(LIMITS.follows, LIMITS.follows_better * after)
    if ahead and late < low - period:
        what = f'the angle of {joint} does {-1e3 * late:.0f} ms in advance what its goal says'
        yield _found('goal_exchanged', ERROR, what, joint=joint, value=late, sd=period)


def _alike(goals: Sequence[np.ndarray], angles: Sequence[np.ndarray], reach: int) -> np.ndarray:
    """Correlation of goals with the angles so many rows later, from -reach on, (2 reach + 1,)."""
    out = np.zeros(2 * reach + 1)
    for goal, angle in zip(goals, angles, strict=True):
        if len(goal) > 2 * reach:
            ahead = np.pad(angle - angle.mean(), reach)
            out += np.correlate(ahead, goal - goal.mean(), mode='valid')
    power = [sum(float(x @ x) for x in parts) for parts in (goals, angles)]
    return np.asarray(out / max(np.sqrt(power[0] * power[1]), 1e-300))


def _unsigned(recording: Recording, j: int, joint: str) -> Iterator[Found]:
    """Whether negative speeds were read as positive numbers, far above all others."""
    speed = np.concatenate([e.dq[:, j] for e in recording.episodes])
    slope = np.concatenate([np.gradient(e.q[:, j], e.t) for e in recording.episodes])
    values = np.unique(speed)
    gaps = np.diff(values)
    if len(values) < 2 or values[0] < 0 or gaps.max() < LIMITS.bands_apart * values[-1]:
        return
    back = speed > values[np.argmax(gaps)]
    if min(back.sum(), (~back).sum()) < LIMITS.fewest:
        return
    found = {'speed_wraps': (speed - slope)[back], 'speed_sign_bit': (speed + slope)[back]}
    name = min(found, key=lambda k: float(found[k].std()))
    top, off = float(np.median(found[name])), float(np.median(np.abs(speed - slope)[~back]))
    left = spread(found[name] - top)
    if left < LIMITS.bands * 1.4826 * off + LIMITS.coarse * np.abs(slope).max():
        what = (
            f'negative speeds of {joint} are logged as numbers about {top:.4g} '
            f'{"down" if name == "speed_wraps" else "up"}: their sign was read as a part of them'
        )
        sd = left / float(np.sqrt(back.sum()))
        yield _found(name, ERROR, what, joint=joint, value=top, sd=sd)


def _repeated(recording: Recording, j: int, joint: str) -> Iterator[Found]:
    """Share of the samples of the moving joint that repeat angle and speed of the one before."""
    again = total = 0
    for e in recording.episodes:
        fast = np.abs(e.dq[:-1, j]) * np.diff(e.t) > LIMITS.moves * resolution(e.q[:, j])
        same = (np.diff(e.q[:, j]) == 0) & (np.diff(e.dq[:, j]) == 0)
        again, total = again + int((same & fast).sum()), total + int(fast.sum())
    if total < LIMITS.fewest:
        return
    share, sd = again / total, float(np.sqrt(max(again, 1)) / total)
    if share - LIMITS.sigmas * sd > FAULTS['repeated'].harmless[1]:
        what = f'{100 * share:.0f} ± {100 * LIMITS.sigmas * sd:.0f} % of the samples of {joint} '
        what += 'repeat the one before while it moves'
        yield _found('repeated', WARNING, what, joint=joint, value=share, sd=sd)


def _coarse(recording: Recording, j: int, joint: str, unit: str) -> Iterator[Found]:
    q = np.concatenate([e.q[:, j] for e in recording.episodes])
    values, span = np.unique(q), float(np.ptp(q))
    if not span or len(values) > len(q) / 2:
        return
    step = float(np.diff(values).min())
    most = min(LIMITS.coarse * span, FAULTS['quantised'].harmless[1])
    if step > most and len(q) > LIMITS.fewest:
        what = f'the angle of {joint} has {len(values)} different values, {step:.2g} {unit} apart'
        yield _found('quantised', WARNING, what, joint=joint, value=step)
