# SPDX-License-Identifier: Apache-2.0
"""`limits:` of a model file: how far a parameter of an effect may go on this robot."""

from collections.abc import Mapping

from leo_msgs_py.errors import UserError
from leo_sim.common.names import nearest
from leo_sim.common.yaml_file import Finite, Schema
from leo_sim.description.robot import Robot
from leo_sim.effects import get_effect
from leo_sim.effects.base import Effect
from leo_sim.effects.parameter import has_unit, Parameter

Limits = dict[str, tuple[float, float]]


class LimitFile(Schema):
    """A range that a parameter stays in."""

    range: tuple[Finite, Finite]
    unit: str


def limit_keys(effect: str, where: str, parameter: str) -> tuple[str, str]:
    """How `limits` names a parameter at one place, and at all of them."""
    return f'{effect}:{where}.{parameter}', f'{effect}.{parameter}'


def checked_limits(robot: Robot, given: Mapping[str, LimitFile]) -> Limits:
    """Ranges by `effect.parameter` or `effect:where.parameter`.

    Raises:
        UserError: One line: an unknown name, another unit, an empty range, or one that leaves out
            that nothing is missing.
    """
    return {key: _checked(robot, key, limit) for key, limit in given.items()}


def _checked(robot: Robot, key: str, limit: LimitFile) -> tuple[float, float]:
    (places, parameter), (low, high) = _named(robot, key), limit.range
    if not has_unit(robot, places, parameter, limit.unit):
        raise UserError(f'limits: {key}: the unit is {parameter.unit!r}, found {limit.unit!r}')
    if not low < high:
        raise UserError(f'limits: {key}: {low:g} to {high:g} is no range')
    if not low <= parameter.neutral <= high:
        raise UserError(
            f'limits: {key}: {parameter.neutral:g}, which is no effect, is not within '
            f'{low:g} to {high:g}'
        )
    return low, high


def limited_parameter(robot: Robot, key: str) -> Parameter:
    """The parameter that a key of `limits` names; UserError for one that is none."""
    return _named(robot, key)[1]


def _named(robot: Robot, key: str) -> tuple[tuple[str, ...], Parameter]:
    """The places and the parameter that a key names."""
    label, _, name = key.rpartition('.')
    effect_name, _, where = label.partition(':')
    effect = get_effect(effect_name)
    places = _places(robot, effect, where, key)
    known = effect.parameters_for(robot, places)
    found = next((p for p in known if p.name == name), None)
    if found is None:
        names = [p.name for p in known]
        raise UserError(f'limits: {effect_name} has no {name!r}{nearest(name, names)}')
    return places, found


def _places(robot: Robot, effect: Effect, where: str, key: str) -> tuple[str, ...]:
    places = effect.places(robot)
    if where in ('', 'all'):
        return places
    if where not in places:
        raise UserError(f'limits: {key}: {effect.name} does not act there{nearest(where, places)}')
    return (where,)
