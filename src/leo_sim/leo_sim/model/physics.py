# SPDX-License-Identifier: Apache-2.0
"""What decides how a model moves, in texts: kept with what is learned on it, compared later."""

from collections.abc import Mapping
import hashlib
from typing import Any

from leo_sim.description.robot import Robot
from leo_sim.effects import Placed
from leo_sim.model.model import Model

Physics = dict[str, Any]
"""Texts by what they are about; of several constants or effects a dict or list of texts."""


def of_robot(robot: Robot) -> Physics:
    """What a state, an input and a step are, for what is learned on any model of a robot."""
    period = f'{float(robot.control_period)!r} s'
    return {'robot': robot.name, 'input': robot.input_unit, 'control period': period}


def of_model(model: Model) -> Physics:
    """All that decides the next state, but for how exactly it is integrated."""
    robot = model.robot
    tree = '\n'.join([robot.urdf, *(contact.model_dump_json() for contact in robot.contacts)])
    units = {path: constant.unit for path, constant in robot.constants.items()}
    constants = {p: f'{float(v)!r} {units[p]}'.strip() for p, v in model.constants.items()}
    own = {placed.effect.name: placed.effect.digest for placed in model.effects}
    return of_robot(robot) | {
        'list of effects': sorted(map(_effect, model.effects)),
        'laws': {f'file of {name} (hash)': digest for name, digest in own.items() if digest},
        'constants': constants,
        'description (hash)': hashlib.sha256(tree.encode()).hexdigest()[:12],
    }


def differing(kept: Mapping[str, Any], now: Mapping[str, Any]) -> str:
    """The first thing that is not as it was kept, in words; '' where all is.

    What is not kept, as by an earlier version, is not asked for.
    """
    for name, was in kept.items():
        here = now.get(name)
        if was == here:
            continue
        if isinstance(was, Mapping) and isinstance(here, Mapping):
            if said := differing(was, here):
                return said
            continue
        return f'another {name} ({_shown(was)}, here {_shown(here)})'
    return ''


def _effect(placed: Placed) -> str:
    values = ' '.join(f'{name}={float(v)!r}' for name, v in sorted(placed.parameters.items()))
    return f'{placed.effect.name} at {" ".join(placed.where)} {values}'


def _shown(value: object) -> str:
    if isinstance(value, list):
        return ', '.join(map(str, value)) or 'none'
    return 'none' if value is None else str(value)
