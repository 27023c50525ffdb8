# SPDX-License-Identifier: Apache-2.0
"""Faults that show in the balance of torques: of inputs, of the angle's zero, of time."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

import numpy as np

from leo_diffmodel.bags.recording import Recording
from leo_diffmodel.compare.windows import sample_period
from leo_diffmodel.faults.balance import Balance, balance, Figure
from leo_diffmodel.faults.base import Found
from leo_diffmodel.faults.catalogue import FAULTS
from leo_diffmodel.outside.flow import flow
from leo_diffmodel.outside.rate import with_true_rates
from leo_sim.model import Model

GAINED = 0.65
"""What is left over with a delay, as a share of what is left without: on 39 joints of real
recordings whose inputs are right 0.72 or more, of those moved by 0.1 and 0.18 s 0.43 to 0.58
where the motor shows at all."""
ABOUT_ONE = (0.5, 2.0)
"""A factor of gravity or motor that no fault of the log has changed."""
ALIKE = 0.3
"""Natural logarithm: as far apart the factors of weight and motor may be that stretched time
changes alike."""

DRIVES = 0.25
"""Of all torques: what the weight must give to be told anything by, and a motor whose factor may
be near 0: that of a motor that others move against is, whatever its unit."""
CLEAR = 0.5
"""Relative: the weight's factor must be known so well for others to be told against it."""
CLEAR_ANGLE = 0.6
"""rad: where gravity pulls to must be known so well for a zero to be told."""


def balances(recording: Recording, model: Model) -> dict[str, Balance]:
    """The balance of each joint that shows it; of a robot on the ground only when it is held."""
    if model.robot.contacts and not recording.held:
        return {}
    seen = flow(with_true_rates(recording), model)
    if seen is None:
        return {}
    usual = FAULTS['input_late'].harmless
    with np.errstate(all='ignore'):
        found = {name: balance(seen, model, j, usual) for j, name in enumerate(recording.joints)}
    return {
        name: b
        for name, b in found.items()
        if b is not None and name not in model.robot.base_joints
    }


def dynamic_faults(recording: Recording, found: dict[str, Balance]) -> list[Found]:
    """What is wrong with inputs, zeros and time.

    Args:
        recording: whose kinematics are in order.
        found: its balances.
    """
    out: list[Found] = []
    for name, b in found.items():
        out += list(_zero(name, b)) or list(_compensated(name, b))
        if name in recording.actuators and recording.input != 'position':
            out += _motor(name, b)
    if recording.input in ('voltage', 'torque'):
        out += _late([(n, b) for n, b in found.items() if n in recording.actuators], recording)
    return [*out, *([] if out else _time(found))]


def _motor(joint: str, b: Balance) -> Iterator[Found]:
    gain, (low, high) = _gain(b), FAULTS['input_scale'].harmless
    if gain is None:
        return
    size = abs(gain.value)
    if b.shares['motor'] < DRIVES and size - gain.half < low:
        return
    if gain.value + gain.half < 0 and _near_one(b.figures.get('weight')):
        what = f'{joint} goes against its motor'
        yield _found('input_sign', joint, Figure(-1.0, gain.sd, gain.worst), what)
    too_small, too_large = size + gain.half < low, size - gain.half > high
    if (too_small or too_large) and _near_one(b.figures.get('weight')):
        scale = Figure(1 / size, gain.sd / size**2, gain.worst / size**2)
        what = (
            f'{joint} is moved by {size:.3g} ± {gain.half:.2g} of what the log of its input says'
        )
        yield _found('input_scale', joint, scale, what)


def _gain(b: Balance) -> Figure | None:
    """The motor's factor, against that of the weight where this is known.

    An inertia that the model lacks makes both small alike.
    """
    motor, weight = b.figures.get('motor'), b.figures.get('weight')
    if motor is None or weight is None or weight.half > CLEAR * weight.value:
        return motor
    return Figure(motor.value / weight.value, motor.sd / weight.value, motor.worst / weight.value)


def _near_one(figure: Figure | None) -> bool:
    """Whether gravity, where there is some, does not contradict itself."""
    return figure is None or ABOUT_ONE[0] - figure.half < figure.value < ABOUT_ONE[1] + figure.half


def _zero(joint: str, b: Balance) -> Iterator[Found]:
    """Where gravity pulls to, by its part along and its part across the model's."""
    if not {'weight', 'across'} <= set(b.figures):
        return
    along, across = b.figures['weight'], b.figures['across']
    size = float(np.hypot(along.value, across.value))
    if not ABOUT_ONE[0] < size < ABOUT_ONE[1]:
        return
    zero = -float(np.arctan2(across.value, along.value))
    off = Figure(
        zero, float(np.hypot(along.sd, across.sd)) / size, max(along.worst, across.worst) / size
    )
    if off.half < CLEAR_ANGLE and abs(zero) - off.half > FAULTS['angle_zero'].harmless[1]:
        what = f'gravity pulls {joint} as if its zero were off by {zero:.2f} ± {off.half:.2f} rad'
        yield _found('angle_zero', joint, off, what)


def _compensated(joint: str, b: Balance) -> Iterator[Found]:
    if not {'weight', 'motor'} <= set(b.figures):
        return
    weight, motor = b.figures['weight'], b.figures['motor']
    missing = 1 - weight.value
    moved = ABOUT_ONE[0] < motor.value < ABOUT_ONE[1] and motor.half < ABOUT_ONE[0]
    least = FAULTS['gravity_compensated'].harmless[1]
    if moved and least < missing - weight.half and missing < 1 + weight.half:
        what = (
            f'{joint} moves as if {100 * missing:.0f} ± {100 * weight.half:.0f} % of its '
            'weight were carried by something that is not in the log'
        )
        yield _found('gravity_compensated', joint, Figure(missing, weight.sd, weight.worst), what)


def _late(found: Sequence[tuple[str, Balance]], recording: Recording) -> Iterator[Found]:
    """One clock for all inputs: the joint that tells best, and none that contradicts it."""
    told = [(b.figures['late'], b) for _, b in found if 'late' in b.figures]
    if not told:
        return
    late, b = min(told, key=lambda t: t[0].half)
    agree = all(abs(other.value - late.value) < other.half + late.half for other, _ in told)
    low, high = FAULTS['input_late'].harmless
    if not agree or b.gained > GAINED or _within(late, low - sample_period([recording]), high):
        return
    way = 'after' if late.value > 0 else 'before'
    what = f'inputs act {1e3 * abs(late.value):.0f} ± {1e3 * late.half:.0f} ms {way} their stamps'
    yield _found('input_late', '', late, what)


def _within(figure: Figure, low: float, high: float) -> bool:
    return figure.value - figure.half < high and figure.value + figure.half > low


def _time(found: dict[str, Balance]) -> Iterator[Found]:
    """Whether gravity swings the joints faster or slower than the model, by the best joint.

    Slower may be an inertia as well that the model lacks, and is no error.
    """
    told = [
        (b.figures['weight'], b.figures.get('motor'))
        for b in found.values()
        if b.shares.get('weight', 0.0) > DRIVES
    ]
    if not told:
        return
    weight, motor = min(told, key=lambda t: t[0].half)
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
        slower = '' if stretch < 1 else 'an inertia is missing in the model (armature)'
        yield Found(
            FAULTS['time_stretch'],
            '',
            stretch,
            factor.sd,
            what,
            not slower,
            'balance',
            factor.worst,
            otherwise=(slower,) if slower else (),
        )


def _alike(weight: Figure, motor: Figure) -> bool:
    """Whether the motor's factor may be the weight's, a gain that is a bit off apart."""
    apart = abs(np.log(max(motor.value, 1e-3) / weight.value))
    return bool(apart < ALIKE + motor.half / max(motor.value, 1e-3))


def _found(name: str, joint: str, figure: Figure, what: str) -> Found:
    return Found(FAULTS[name], joint, figure.value, figure.sd, what, True, 'balance', figure.worst)
