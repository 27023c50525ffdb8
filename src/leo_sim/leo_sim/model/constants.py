# SPDX-License-Identifier: Apache-2.0
"""Constants of a model: other values than the robot's, those of model.yaml, those of recordings.

Some differ between recordings of one robot: a payload, a gain.
"""

from collections.abc import Mapping, Sequence
from dataclasses import replace
from fnmatch import fnmatchcase
from pathlib import Path
from typing import Any

import numpy as np
from pydantic import Field

from leo_msgs_py.errors import UserError
from leo_msgs_py.names import look_up
from leo_sim.common.yaml_file import Finite, Quantity
from leo_sim.description.constants import checked
from leo_sim.description.robot import Constant, load_robot, Robot

Values = Mapping[str, Any]
"""Of one constant, by the name of the recording: floats, or arrays (S, 1, 1) of S models."""


class ConstantFile(Quantity):
    """A constant; it may have a value of its own in each recording."""

    per_recording: bool = False  # each recording's value is refitted by itself, within `uncertain`
    # values by the name of the recording: known, or where `per_recording` starts
    recordings: dict[str, Finite] = Field(default_factory=dict)


Given = Mapping[str, ConstantFile]  # by path


def all_constants(robot: Robot, changed: Mapping[str, Any]) -> dict[str, Any]:
    """Values of all constants of a robot by path, some of them others; UserError: no such one."""
    for path in changed:
        _known(robot, path)
    return {path: c.value for path, c in robot.constants.items()} | dict(changed)


def checked_by_recording(robot: Robot, given: Mapping[str, Values]) -> dict[str, Values]:
    """The constants that have values of their own in some recordings, by path.

    UserError: one that the robot does not have, or a robot that stands on a ground.
    """
    found = {path: values for path, values in given.items() if values}
    for path in [*found, *(c.path for c in robot.constants.values() if c.per_recording)]:
        _known(robot, path)
        if robot.contacts:
            raise UserError(
                f'{path}: {robot.name} stands on a ground, where a constant has one '
                'value in all bags; leave per_recording and recordings out, and '
                'explain the bags one by one (--each)'
            )
    return found


def _known(robot: Robot, path: str, where: str = '') -> Constant:
    return look_up(path, robot.constants, f'{where}{robot.name} has no constant')


def chosen(values: Values, otherwise: Any, names: Sequence[str], source: Any) -> Any:
    """The value of a constant in each window: a float, (..., W, 1) or (..., W, 1, 1).

    Values are by the name of the recording, in all others it is `otherwise`; source says which of
    the named ones each window comes from, (W,) or (W, 1), or a number for one.
    """
    each = [np.asarray(values.get(name, otherwise), dtype=float) for name in names]
    table = np.stack(np.broadcast_arrays(*(v.reshape(v.shape[:1]) for v in each)), axis=-1)
    picked = table[..., source]
    return float(picked) if not picked.ndim else picked[..., None]


def expanded(robot: Robot, given: Given) -> dict[str, ConstantFile]:
    """Constants by their whole paths: `actuators.*.resistance` stands for each of them.

    What a file says of one of them holds for that one. A pattern of none stays as it is.
    """
    result: dict[str, ConstantFile] = {}
    for pattern in (name for name in given if '*' in name):
        fitting = [name for name in robot.constants if fnmatchcase(name, pattern)]
        result |= dict.fromkeys(fitting or [pattern], given[pattern])
    return result | {name: c for name, c in given.items() if '*' not in name}


def checked_constants(path: Path, robot: Robot, given: Given) -> dict[str, Constant]:
    """Constants of a robot as a file gives them; UserError for one that is wrong."""
    where = f'{path}: constants'
    return {
        name: _constant(where, name, constant, _known(robot, name, f'{where}: '))
        for name, constant in given.items()
    }


def _constant(where: str, name: str, given: ConstantFile, known: Constant) -> Constant:
    uncertain = given.uncertain or known.uncertain
    if given.per_recording and uncertain is None:
        raise UserError(
            f'{where}: {name}: per_recording refits it, so say in which range: '
            'uncertain: [low, high]; known values go under recordings alone'
        )
    for recording, value in given.recordings.items():
        within = uncertain if given.per_recording else None
        own = Quantity(value=value, unit=given.unit, uncertain=within)
        checked(f'{where}: recordings: {recording}', name, own, known.unit)
    whole = Quantity(value=given.value, unit=given.unit, uncertain=uncertain)
    sure = frozenset() if given.per_recording else frozenset(given.recordings)
    found = checked(where, name, whole, known.unit)
    return replace(found, per_recording=given.per_recording, known=sure)


def changed_constants(
    robot: Robot, values: Mapping[str, Any], by_recording: Mapping[str, Values]
) -> dict[str, Any]:
    """Constants that differ from the robot's files, as model.yaml takes them."""
    original = load_robot(robot.folder).constants
    changed: dict[str, Any] = {}
    for name, constant in robot.constants.items():
        entry = _entry(replace(constant, value=float(values[name])))
        if constant.per_recording:
            entry['per_recording'] = True
        if own := by_recording.get(name):
            entry['recordings'] = {recording: float(value) for recording, value in own.items()}
        if entry != _entry(original[name]):
            changed[name] = entry
    return changed


def _entry(constant: Constant) -> dict[str, Any]:
    entry: dict[str, Any] = {'value': constant.value, 'unit': constant.unit}
    return entry if constant.uncertain is None else entry | {'uncertain': [*constant.uncertain]}
