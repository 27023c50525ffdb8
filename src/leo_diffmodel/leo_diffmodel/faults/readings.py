# SPDX-License-Identifier: Apache-2.0
"""Angle and speed contradict each other: which of the two is wrong, or is it the clock?"""

from collections.abc import Sequence
from dataclasses import dataclass, replace
import math

import numpy as np

from leo_diffmodel.bags.recording import Recording
from leo_diffmodel.faults.dynamics import balances
from leo_diffmodel.faults.found import Found
from leo_diffmodel.faults.mending import mapped
from leo_diffmodel.faults.settings import LIMITS
from leo_sim.model import Model

CONTRADICTIONS = ('speed_scale', 'speed_sign')
ANGLES = {
    180 / math.pi: 'degrees',
    1 / (2 * math.pi): 'turns',
    200 / math.pi: 'gons',
    4096 / (2 * math.pi): 'counts of 12 bits',
    1000.0: 'milliradians',
}
"""How many of a unit are one radian."""
SPEEDS = {
    180 / math.pi: 'degrees per second',
    30 / math.pi: 'revolutions per minute',
    1 / (2 * math.pi): 'revolutions per second',
    30 / math.pi / 0.229: 'steps of 0.229 rpm',
    1000.0: 'milliradians per second',
}
"""How many of a unit are one radian per second."""


@dataclass(frozen=True)
class Reading:
    """One way to resolve a contradiction: the fault that it would be, and how far it is off."""

    found: Found
    off: float  # distance of the torques' factor from 1 (natural logarithm)
    half: float  # what `off` is known to; infinite where nothing shows


def who_is_right(recording: Recording, model: Model | None, found: Sequence[Found]) -> list[Found]:
    """The faults with contradictions of scales resolved by the torques, where a model is given."""
    out = [f for f in found if f.code not in CONTRADICTIONS]
    for joint in dict.fromkeys(f.joint for f in found if f.code in CONTRADICTIONS):
        out += _resolved(recording, model, joint, found)
    clock = next((f for f in out if f.code == 'time_stretch'), None)
    return out if clock is None else [clock, *(f for f in out if not _explains(clock, f))]


def _explains(clock: Found, other: Found) -> bool:
    """Whether a clock that is off makes another contradiction of scales needless."""
    if other.code not in ('speed_scale', 'time_stretch', 'angle_scale'):
        return False
    scale = 1 / other.value if other.code == 'angle_scale' else other.value
    return abs(scale / clock.value - 1) < LIMITS.same_clock


def _resolved(
    recording: Recording, model: Model | None, joint: str, found: Sequence[Found]
) -> list[Found]:
    of_joint = {f.code: f for f in found if f.joint == joint}
    rest = [f for f in of_joint.values() if f.error and f.code not in CONTRADICTIONS]
    out = []
    if 'speed_scale' in of_joint:
        signed = [of_joint['speed_sign']] if 'speed_sign' in of_joint else []
        out.append(_chosen(recording, model, [*rest, *signed], _scales(of_joint['speed_scale'])))
    if 'speed_sign' in of_joint:
        sign = of_joint['speed_sign']
        what = f'the logged angle of {joint} has the other sign than its speed and its torques'
        other = replace(sign, code='angle_sign', what=what)
        out.append(_chosen(recording, model, [*rest, *out], [sign, other]))
    return out


def _scales(found: Found) -> list[Found]:
    """Speed, angle or clock: what each would have to be off by."""
    k, sd = found.value, found.sd / found.value**2
    size = f'{1 / k:.4g} ± {LIMITS.sigmas * found.sd / k**2:.2g}'
    what = f'the logged angle of {found.joint} is {size} times what its speed adds up to'
    inverse = replace(found, code='angle_scale', value=1 / k, sd=sd, what=what)
    out = [_with_unit(found, SPEEDS), _with_unit(inverse, ANGLES)]
    if LIMITS.stretches[0] < k < LIMITS.stretches[1]:
        what = f'a second of the log lasts {size} s: its speeds are {k:.4g} times the change of '
        what += 'its angles'
        out.append(replace(found, code='time_stretch', joint='', what=what))
    named = [f for f in out if ' that is ' in f.what]
    return [*named, *(f for f in out if f not in named)]


def _with_unit(found: Found, units: dict[float, str]) -> Found:
    """The fault with the unit in words that its value stands for, if it does for one."""
    off, unit = min((abs(found.value / m - 1), name) for m, name in units.items())
    if off >= max(LIMITS.unit_near, 2 * found.sd / abs(found.value)):
        return found
    return replace(found, what=f'{found.what}; that is {unit}')


def _chosen(
    recording: Recording, model: Model | None, rest: Sequence[Found], readings: Sequence[Found]
) -> Found:
    """The reading under which the torques balance, with the others that are left.

    The first one stands where no other balances clearly better.
    """
    seen = [_seen(recording, model, rest, r) for r in readings]
    clear = [s for s in seen if s.half < LIMITS.clear]
    best = min(clear, key=lambda s: s.off, default=seen[0])
    first = best if seen[0].off - best.off > LIMITS.readings_apart else seen[0]
    unsure, most = first.half >= LIMITS.clear, LIMITS.readings_apart + first.half
    left = [s for s in seen if s is not first and (unsure or s.off - first.off < most)]
    return replace(first.found, otherwise=tuple(s.found.what for s in left))


def _seen(
    recording: Recording, model: Model | None, rest: Sequence[Found], reading: Found
) -> Reading:
    """How far gravity, or the motor where there is none, is from what it should be then."""
    found = balances(mapped(recording, [*rest, reading]), model) if model else {}
    balance = found.get(reading.joint) or next(iter(found.values()), None)
    signed = reading.code.endswith('sign')
    names = ('motor',) if signed else ('weight', 'motor')
    figures = balance.figures if balance else {}
    figure = next((figures[name] for name in names if name in figures), None)
    if figure is None:
        return Reading(reading, 0.0, np.inf)
    least = LIMITS.least_factor
    half = (LIMITS.sigmas * figure.sd + 0.5 * figure.worst) / max(abs(figure.value), least)
    if signed:
        return Reading(reading, 0.0 if figure.value > 0 else LIMITS.wrong_way, half)
    return Reading(reading, abs(float(np.log(max(figure.value, least)))), half)
