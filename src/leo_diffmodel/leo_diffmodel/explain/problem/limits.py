# SPDX-License-Identifier: Apache-2.0
"""Plausible range of every parameter, from the robot itself: what no fit may leave.

A friction stronger than the motor stalls it, a link does not weigh twenty times what was drawn,
a measurement is no later than what a window remembers. A value on its limit is no answer.
"""

from __future__ import annotations

from dataclasses import replace
from math import inf, isfinite

from leo_diffmodel.compare.noise import HISTORY
from leo_diffmodel.compare.sizes import (
    force_scale,
    gravity_scale,
    inertia_scale,
    mass_scale,
    reach,
    stall_torque,
    torque_scale,
)
from leo_diffmodel.compare.unit_sizes import UnitSizes
from leo_diffmodel.explain.problem.hypothesis import Candidate
from leo_diffmodel.explain.settings import Grids
from leo_sim.description.robot import Robot
from leo_sim.effects import Parameter
from leo_sim.model import Model
from leo_sim.model.model_file import limit_keys


def limited(candidate: Candidate, model: Model, grids: Grids) -> Candidate:
    """A candidate whose parameters stay within what is plausible for the robot.

    The model file may say otherwise (`limits:`), within what the effect allows at all.
    """
    kept = [_limited(p, candidate, model, grids) for p in candidate.parameters]
    return replace(candidate, parameters=tuple(kept))


def at_limit(parameter: Parameter, value: float, half: float) -> bool:
    """Whether a value with its confidence interval reaches a limit that is not `no effect`."""
    ends = [e for e in (parameter.low, parameter.high) if e != parameter.neutral and isfinite(e)]
    return any(abs(value - e) <= max(half, 1e-6 * abs(e)) for e in ends)


def _limited(parameter: Parameter, candidate: Candidate, model: Model, grids: Grids) -> Parameter:
    keys = limit_keys(candidate.effect.name, candidate.where, parameter.name)
    given = next((model.limits[k] for k in keys if k in model.limits), None)
    low, high = given or _range(parameter, candidate, model, grids)
    return replace(parameter, low=max(parameter.low, low), high=min(parameter.high, high))


def _range(
    parameter: Parameter, candidate: Candidate, model: Model, grids: Grids
) -> tuple[float, float]:
    unit, fixed = parameter.unit, _fixed(parameter, candidate, grids)
    if candidate.effect.hook == 'ground' and parameter.neutral > 0:
        return parameter.neutral / grids.ground, parameter.neutral * grids.ground
    if unit in ('kg', 'kg m2'):
        return _inertial(unit, candidate, model, grids)
    if fixed is not None:
        return fixed
    sizes = _sizes(model.robot, candidate.where, grids.heavier)
    most = sizes.large(candidate.effect.name, parameter)
    if sizes.of(unit) is None or (unit == 'V' and parameter.role == 'threshold'):
        return -inf, inf
    most *= grids.per_load if unit in ('1/N m', '1/N') else 1.0
    return -most, most


def _fixed(parameter: Parameter, candidate: Candidate, grids: Grids) -> tuple[float, float] | None:
    """Of what no robot makes larger: scales, times, rates at which sticking ends, angles."""
    unit = parameter.unit
    if unit == '' and parameter.neutral == 1.0:
        return grids.gain
    if unit == 's':
        longest = HISTORY if candidate.effect.late else grids.lag_seconds
        most = longest if parameter.role == 'delay' else grids.drift_seconds
        return -most, most
    if unit == 'rad':
        most = _angle(parameter, candidate, grids)
        return -most, most
    return {
        'rad/s': grids.settling_rates,
        'm/s': grids.settling_speeds,
        '1/turn': grids.periods,
        '1/m': grids.periods,
    }.get(unit)


def _sizes(robot: Robot, where: str, heavier: float) -> UnitSizes:
    """The most that is plausible of each quantity, at 1 rad/s, 0.5 rad and a reach per second."""
    length, torque = reach(robot), _torque(robot, where)
    return UnitSizes(
        torque=torque,
        rate=1.0,
        angle=0.5,
        force=max(torque / length, _weight(robot, heavier), force_scale(robot)),
        speed=length,
        length=length,
        inertia=heavier * inertia_scale(robot),
        mass=heavier * mass_scale(robot),
        input=max((a.strongest for a in robot.actuators), default=1.0),
    )


def _angle(parameter: Parameter, candidate: Candidate, grids: Grids) -> float:
    if parameter.role == 'threshold':
        return grids.gap
    return grids.offset if candidate.effect.hook == 'sensor' else float('inf')


def _torque(robot: Robot, where: str) -> float:
    """The most that a motor there or gravity gives [N m]."""
    stall = None if where in robot.slides else stall_torque(robot, where)
    stall = stall or torque_scale(robot)
    return max(stall, gravity_scale(robot))


def _weight(robot: Robot, heavier: float) -> float:
    """Of all that moves, several times over [N]."""
    g = robot.constants['gravity'].value
    return heavier * g * sum(link.body.mass for link in robot.links)


def _inertial(unit: str, candidate: Candidate, model: Model, grids: Grids) -> tuple[float, float]:
    """Added mass or inertia: less than nothing is left of no link."""
    most = grids.heavier * (mass_scale if unit == 'kg' else inertia_scale)(model.robot)
    if candidate.effect.hook != 'body':
        return -most, most
    path = f'links.{candidate.where}.' + ('mass' if unit == 'kg' else 'inertia')
    own = _least(model, path) if path in model.constants else most
    return (-grids.lighter * own if unit == 'kg' else -most), most


def _least(model: Model, path: str) -> float:
    """The smallest value of a constant in any recording."""
    return min(map(float, (model.constants[path], *model.by_recording.get(path, {}).values())))
