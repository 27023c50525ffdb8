# SPDX-License-Identifier: Apache-2.0
"""Which effects may be missing on this robot, where, and within which limits.

Limits are what is plausible for the robot: a friction stronger than the motor stalls it, a link
does not weigh twenty times what was drawn, a measurement is no later than what a window remembers.
A value on its limit is no answer.
"""

from collections.abc import Iterable, Sequence
from dataclasses import replace
from math import inf, isfinite

import numpy as np

from leo_diffmodel.bags.recording import Recording
from leo_diffmodel.compare.noise import HISTORY
from leo_diffmodel.compare.sizes import inertia_scale, mass_scale
from leo_diffmodel.explain.problem.hypothesis import Candidate
from leo_diffmodel.explain.problem.sizes import most_sizes
from leo_diffmodel.explain.settings import Grids
from leo_sim.description.robot import Constant
from leo_sim.effects import Effect, EFFECTS, Parameter
from leo_sim.effects.base import with_roles
from leo_sim.model import Model
from leo_sim.model.model_file import limit_keys


def seen(
    model: Model, recordings: Sequence[Recording], extra: Iterable[Effect] = ()
) -> tuple[Candidate, ...]:
    """The candidates that recordings can say something about: not of speeds, if none measured."""
    measured = any(r.rates == 'measured' for r in recordings)
    return tuple(c for c in candidates(model, extra) if measured or not c.effect.of_rates)


def candidates(model: Model, extra: Iterable[Effect] = ()) -> tuple[Candidate, ...]:
    """Every effect of the catalogue, and the user's, at every place it can act.

    Joint effects are also tried with one value for all of several joints. What the model holds
    already is left out.
    """
    places = ((p, [*p.where, 'all'] if p.everywhere else p.where) for p in model.effects)
    taken = {(p.effect.name, place) for p, where in places for place in where}
    # what does several effects at once is another thing than these, and found as one, only here
    told = len(model.robot.joint_names) > 1 and not model.robot.contacts
    return tuple(
        Candidate(effect, where, _parameters(effect, model, where))
        for effect in (*EFFECTS.values(), *extra)
        if effect.applies(model.robot) and (told or not effect.together)
        for where in _places(effect, model)
        if (effect.name, where) not in taken
    )


def _places(effect: Effect, model: Model) -> list[str]:
    places = list(effect.places(model.robot))
    if effect.family == 'motor':
        driven = {a.joint for a in model.robot.actuators}
        places = [p for p in places if p in driven]
    if effect.undivided:
        return places if len(places) == 1 else ['all']
    each = [effect.parameters_for(model.robot, (at,)) for at in places]
    alike = len(places) > 1 and effect.hook != 'body'
    alike &= len({tuple((p.unit, p.neutral) for p in own) for own in each}) == 1
    return [*places, 'all'] if alike else places


def _parameters(effect: Effect, model: Model, where: str) -> tuple[Parameter, ...]:
    names = effect.places(model.robot) if where == 'all' else (where,)
    return with_roles(effect, effect.parameters_for(model.robot, names))


def uncertain(model: Model, recordings: Sequence[str] = ('',)) -> tuple[Constant, ...]:
    """The constants that are refitted with every hypothesis, but those known in all recordings.

    Of a constant `per_recording` there is one for each recording whose own value is not known.
    """
    found = []
    for constant in model.robot.constants.values():
        open_in = [name for name in recordings if name not in constant.known]
        if constant.uncertain and constant.per_recording:
            found += [_in(model, constant, name) for name in open_in]
        elif constant.uncertain and open_in:
            found.append(replace(constant, value=float(model.constants[constant.path])))
    return tuple(found)


def own_constants(model: Model, recordings: Sequence[Recording]) -> tuple[Constant, ...]:
    return tuple(c for c in uncertain(model, [r.name for r in recordings]) if c.recording)


def _in(model: Model, constant: Constant, recording: str) -> Constant:
    values, path = model.by_recording.get(constant.path, {}), constant.path
    value = float(values.get(recording, model.constants[path]))
    return replace(constant, value=value, recording=recording)


def limited(candidate: Candidate, model: Model, grids: Grids) -> Candidate:
    """A candidate within what is plausible for the robot, or the `limits:` of its model file."""
    kept = []
    for p in candidate.parameters:
        keys = limit_keys(candidate.effect.name, candidate.where, p.name)
        given = next((model.limits[k] for k in keys if k in model.limits), None)
        low, high = given or _range(p, candidate, model, grids)
        whole = p.whole and p.unit != '1/m'  # in a turn, and not on a way
        kept.append(replace(p, low=max(p.low, low), high=min(p.high, high), whole=whole))
    return replace(candidate, parameters=tuple(kept))


def at_limit(parameter: Parameter, low: float, high: float) -> bool:
    """Whether a confidence interval reaches a limit that is not `no effect`."""
    ends = (parameter.low, low - parameter.low), (parameter.high, parameter.high - high)
    limits = [(e, room) for e, room in ends if e != parameter.neutral and isfinite(e)]
    return any(room <= 1e-6 * abs(e) for e, room in limits)


def _range(
    parameter: Parameter, candidate: Candidate, model: Model, grids: Grids
) -> tuple[float, float]:
    unit, neutral = parameter.unit, parameter.neutral
    if parameter.role == 'threshold' and unit in ('V', 'rad/s', 'm/s', 'rad/s2', 'm/s2'):
        return -inf, inf
    if candidate.effect.hook == 'ground' and neutral > 0:
        return neutral / grids.ground, neutral * grids.ground
    if unit in ('kg', 'kg m2'):
        return _inertial(unit, candidate, model, grids)
    if fixed := _fixed(parameter, candidate, grids):
        return fixed
    sizes = most_sizes(model.robot, candidate.where, grids.heavier)
    most = sizes.large(candidate.effect.name, parameter)
    if sizes.of(unit) is None:
        return -inf, inf
    most *= grids.per_load if unit in ('1/N m', '1/N') else 1.0
    return -most, most


def _fixed(parameter: Parameter, candidate: Candidate, grids: Grids) -> tuple[float, float] | None:
    """Of what no robot makes larger: scales, times, rates at which sticking ends, angles."""
    unit, effect = parameter.unit, candidate.effect
    if unit == '' and parameter.neutral == 1.0:
        return grids.gain
    if unit == 's':
        longest = HISTORY if effect.late else grids.lag_seconds
        drifts = inf if effect.onset else grids.drift_seconds
        most = longest if parameter.role == 'delay' else drifts
        return -most, most
    if unit == 'rad':
        shift = grids.offset if effect.hook == 'sensor' else inf
        most = {'threshold': grids.gap, 'position': grids.rest}.get(parameter.role, shift)
        return -most, most
    known = {'rad/s': grids.settling_rates, 'm/s': grids.settling_speeds, 'm/s2': grids.gravity}
    return {**known, '1/turn': grids.periods, '1/m': (0.0, inf)}.get(unit)


def _inertial(unit: str, candidate: Candidate, model: Model, grids: Grids) -> tuple[float, float]:
    """Added mass or inertia: less than nothing is left of no link, in no recording."""
    is_mass, robot = unit == 'kg', model.robot
    most = grids.heavier * (mass_scale(robot) if is_mass else inertia_scale(robot))
    if candidate.effect.hook != 'body':
        most = max(most, grids.heavier * _moved(unit, model))
        return -most, most
    if not is_mass:
        return -most, most
    path = f'links.{candidate.where}.mass'
    if path not in model.constants:
        return -grids.lighter * most, most
    own = min(map(float, (model.constants[path], *model.by_recording.get(path, {}).values())))
    return -grids.lighter * own, most


def _moved(unit: str, model: Model) -> float:
    """The most that a motor moves where a run starts, its own too: inertia [kg m2], mass [kg]."""
    start, robot = model.start('nominal', np.random.default_rng(0)), model.robot
    inertia = model.rigid.mass_and_bias(start.q, start.dq)[0].diagonal()
    own = dict(zip(robot.joint_names, inertia + model.laws.rotor_inertia, strict=True))
    driven = [a.joint for a in robot.actuators if (a.joint in robot.slides) == (unit == 'kg')]
    return max((float(own[joint]) for joint in driven), default=0.0)
