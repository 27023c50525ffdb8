# SPDX-License-Identifier: Apache-2.0
"""Faults that show in the balance of torques: of inputs, of the angle's zero, of time."""

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import replace
import math

import numpy as np

from leo_diffmodel.bags.recording import Recording
from leo_diffmodel.faults.balance import Balance, balance, Figure
from leo_diffmodel.faults.catalogue import FAULTS
from leo_diffmodel.faults.found import Found
from leo_diffmodel.faults.inputs import dead_input, exchanged
from leo_diffmodel.faults.left_out import better, misses, Reading
from leo_diffmodel.faults.mending import mapped
from leo_diffmodel.faults.settings import LIMITS
from leo_diffmodel.outside.finding import ERROR, graded
from leo_diffmodel.outside.flow import Flow, flow
from leo_diffmodel.outside.ordinary import follows
from leo_diffmodel.outside.rate import with_true_rates
from leo_sim.model import Model


def balances(recording: Recording, model: Model) -> dict[str, Balance]:
    """The balance of each joint that shows it; of a robot on the ground only when it is held."""
    seen = flow(with_true_rates(recording), model)
    return {} if seen is None else _balances(recording, seen)


def _balances(recording: Recording, seen: Flow) -> dict[str, Balance]:
    with np.errstate(all='ignore'):
        found = {name: balance(seen, j) for j, name in enumerate(recording.joints)}
    base = seen.motion.model.robot.base_joints
    return {name: b for name, b in found.items() if b is not None and name not in base}


def dynamic_faults(recording: Recording, model: Model, settled: Sequence[str] = ()) -> list[Found]:
    """What is wrong with inputs, zeros and time, by the torques of a log without other faults.

    What the balance of one joint suggests is a fault only where it predicts blocks of time that
    were left out better than all that is ordinary. Joints are `settled` whose inputs are in their
    own columns by now, or whose zeros are right.
    """
    seen = flow(with_true_rates(recording), model)
    if seen is None:
        return []
    driven = [*recording.actuators] if recording.input in ('voltage', 'torque') else []
    pair = exchanged(recording, seen, [name for name in driven if name not in settled])
    if pair is not None:
        right = mapped(recording, [pair])
        return [pair, *dynamic_faults(right, model, [*settled, *pair.names])]
    dead = [f for name in driven for f in dead_input(recording, seen, name)]
    found = _balances(recording, seen)
    for f in dead:
        found.pop(f.joint, None)
    acting = [name for name in driven if not follows(seen, recording.joints.index(name))]
    told = _suggested(found, driven, acting, recording.state_period)
    told = [*_predicting(recording, seen, told, found)]
    if (zero := _first_zero(told, settled)) is not None:
        right = mapped(recording, [zero])
        return [zero, *dynamic_faults(right, model, [*settled, zero.joint])]
    return [*dead, *told]


def _first_zero(told: Sequence[Found], settled: Sequence[str]) -> Found | None:
    """The wrong zero that predicts best: it turns the weight of all joints beyond it, too."""
    zeros = [f for f in told if f.error and f.code == 'angle_zero']
    open_ = [f for f in zeros if f.joint not in settled]
    return max(open_, key=lambda f: f.gained, default=None) if len(told) > 1 else None


def _suggested(
    found: dict[str, Balance], driven: Sequence[str], acting: Sequence[str], period: float
) -> list[Found]:
    """What the balances say: of `driven` joints of their inputs, too, and when these act.

    The latter where motors do something of their own (`acting`): others come with the motion.
    """
    out: list[Found] = []
    for name, b in found.items():
        zero = [*_zero(name, b)]
        out += zero
        if name in driven:
            out += [*(() if zero else _compensated(name, b)), *_motor(name, b)]
    out += _late([b for n, b in found.items() if n in acting], period)
    return out or list(_time([*found.values()]))


def _predicting(
    recording: Recording, seen: Flow, told: Sequence[Found], joints: Iterable[str]
) -> Iterator[Found]:
    """Those that predict blocks of time better than the log as it is; warnings if not surely."""
    for f in told:
        of_joint = [g for g in told if g.joint == f.joint]
        gained = _gained(recording, seen, f, of_joint, joints) if f.error else np.inf
        if gained > 0:
            yield replace(f, severity=graded(f.error and gained > LIMITS.sure), gained=gained)


def _gained(
    recording: Recording, seen: Flow, f: Found, of_joint: Sequence[Found], joints: Iterable[str]
) -> float:
    """Standard errors by which a log with this fault predicts better than one without."""
    number = recording.joints.index
    right = Reading(math.prod(g.value for g in of_joint if g.fault.channel == 'input'))
    if f.code == 'gravity_compensated':
        right = Reading(share=f.value)
    if f.code in ('input_scale', 'input_sign', 'gravity_compensated'):
        j = number(f.joint)
        return better([misses(seen, j)], [misses(seen, j, right)])
    mended = flow(with_true_rates(mapped(recording, [f])), seen.motion.model)
    if mended is None:
        return 0.0
    each = [*map(number, joints)]
    return better([misses(seen, j) for j in each], [misses(mended, j) for j in each])


def _motor(joint: str, b: Balance) -> Iterator[Found]:
    gain, (low, high) = _gain(b), FAULTS['input_scale'].harmless
    if gain is None:
        return
    size = abs(gain.value)
    if b.shares['motor'] < LIMITS.drives and size - gain.half < low:
        return
    if gain.value + gain.half < 0 and _near_one(b.figures.get('weight')):
        what = f'{joint} goes against its motor'
        yield _found('input_sign', joint, Figure(-1.0, gain.sd, gain.worst), what)
    too_small, too_large = size + gain.half < low, size - gain.half > high
    if (too_small or too_large) and _near_one(b.figures.get('weight')):
        scale = Figure(1 / size, gain.sd / size**2, gain.worst / size**2)
        share = f'{size:.3g} ± {gain.half:.2g}'
        what = f'{joint} is moved by {share} of what the log of its input says'
        yield _found('input_scale', joint, scale, what)


def _gain(b: Balance) -> Figure | None:
    """The motor's factor, against a known weight's: a missing inertia makes both small."""
    motor, weight = b.figures.get('motor'), b.figures.get('weight')
    if motor is None or weight is None or weight.half > LIMITS.clear * weight.value:
        return motor
    return Figure(motor.value / weight.value, motor.sd / weight.value, motor.worst / weight.value)


def _near_one(figure: Figure | None) -> bool:
    """Whether gravity, where there is some, does not contradict itself."""
    low, high = LIMITS.about_one
    return figure is None or low - figure.half < figure.value < high + figure.half


def _zero(joint: str, b: Balance) -> Iterator[Found]:
    """Where gravity pulls to, by its part along and its part across the model's.

    Another zero leaves the weight as large as it is; a force or a load changes it.
    """
    if not {'weight', 'across'} <= set(b.figures):
        return
    along, across = b.figures['weight'], b.figures['across']
    size = float(np.hypot(along.value, across.value))
    low, high = LIMITS.about_one
    if not low < size < high:
        return
    zero = -float(np.arctan2(across.value, along.value))
    sd, worst = float(np.hypot(along.sd, across.sd)), max(along.worst, across.worst)
    off = Figure(zero, sd / size, worst / size)
    if off.half < LIMITS.clear_angle and abs(zero) - off.half > FAULTS['angle_zero'].harmless[1]:
        what = f'gravity pulls {joint} as if its zero were off by {zero:.2f} ± {off.half:.2f} rad'
        same = abs(size - 1.0) < off.half * size
        other = () if same or along.value < 0 else ('a force or a load is missing in the model',)
        fault = _found('angle_zero', joint, off, what)
        yield replace(fault, severity=graded(not other), otherwise=other)


def _compensated(joint: str, b: Balance) -> Iterator[Found]:
    if not {'weight', 'motor'} <= set(b.figures):
        return
    weight, motor = b.figures['weight'], b.figures['motor']
    missing = 1 - weight.value
    low, high = LIMITS.about_one
    moved = low < motor.value < high and motor.half < low
    least = FAULTS['gravity_compensated'].harmless[1]
    if moved and least < missing - weight.half and missing < 1 + weight.half:
        what = f'{joint} moves as if {100 * missing:.0f} ± {100 * weight.half:.0f} % of its '
        what += 'weight were carried by something that is not in the log'
        yield _found('gravity_compensated', joint, Figure(missing, weight.sd, weight.worst), what)


def _late(found: Sequence[Balance], period: float) -> Iterator[Found]:
    """One clock for all inputs: the joint that is surest, and none that contradicts it."""
    shown = [(b.figures['late'], b) for b in found if 'late' in b.figures]
    if not shown:
        return
    late, b = min(shown, key=lambda pair: pair[0].half)
    agree = all(abs(other.value - late.value) < other.half + late.half for other, _ in shown)
    low, high = FAULTS['input_late'].harmless
    low -= period
    may_be_good = late.value - late.half < high and late.value + late.half > low
    if agree and not (b.gained > LIMITS.gained or may_be_good):
        way = 'after' if late.value > 0 else 'before'
        size = f'{1e3 * abs(late.value):.0f} ± {1e3 * late.half:.0f} ms'
        yield _found('input_late', '', late, f'inputs act {size} {way} their stamps')


def _time(found: Sequence[Balance]) -> Iterator[Found]:
    """Whether gravity swings the joints faster or slower than the model, by the surest joint.

    Slower may be an inertia as well that the model lacks, and is no error.
    """
    heavy = [b.figures for b in found if b.shares.get('weight', 0.0) > LIMITS.drives]
    if not heavy:
        return
    figures = min(heavy, key=lambda f: f['weight'].half)
    weight, motor = figures['weight'], figures.get('motor')
    if weight.value <= 0 or weight.value - weight.half <= 0:
        return
    if motor is not None and not _alike(weight, motor):
        return
    stretch = float(weight.value**-0.5)
    share = stretch / (2 * weight.value)
    factor = Figure(stretch, weight.sd * share, weight.worst * share)
    low, high = FAULTS['time_stretch'].harmless
    edges = ((weight.value + weight.half) ** -0.5, (weight.value - weight.half) ** -0.5)
    if edges[0] > high or edges[1] < low:
        what = f'swings last {stretch:.3f} ± {factor.half:.2f} times as long as gravity has them'
        slower = () if stretch < 1 else ('an inertia is missing in the model (armature)',)
        fault = _found('time_stretch', '', factor, what)
        yield replace(fault, severity=graded(not slower), otherwise=slower)


def _alike(weight: Figure, motor: Figure) -> bool:
    """Whether the motor's factor may be the weight's, a gain that is a bit off apart."""
    apart = abs(np.log(max(motor.value, 1e-3) / weight.value))
    return bool(apart < LIMITS.alike + motor.half / max(motor.value, 1e-3))


def _found(name: str, joint: str, figure: Figure, what: str) -> Found:
    return Found(name, ERROR, what, joint=joint, evidence='balance', **vars(figure))
