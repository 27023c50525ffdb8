# SPDX-License-Identifier: Apache-2.0
"""What recordings say of the robot they were made with: a payload, a length, a gain."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace

from leo_diffmodel.bags.recording import Recording
from leo_msgs_py.errors import UserError
from leo_sim.common.names import nearest
from leo_sim.common.yaml_file import Quantity
from leo_sim.description.constants import checked, Constant
from leo_sim.model import Model


def with_known(model: Model, recordings: Sequence[Recording]) -> Model:
    """The model with the constants that recordings know of themselves, in place of its own.

    What a recording knows is not refitted in it, also where the model calls it uncertain.

    Raises:
        UserError: a constant that the robot does not have, a value that it cannot have, or
            recordings that have one name, by which such constants go.
    """
    own, constants = _taken(model, recordings)
    if any(own.values()) or any(c.per_recording for c in constants.values()):
        _apart(recordings)
    if not any(r.constants for r in recordings):
        return model
    robot, shared = model.robot.with_constants(constants), dict(model.constants)
    if robot.contacts:
        shared |= {path: own.pop(path).popitem()[1] for path in _agreed(own, len(recordings))}
    return model.changed(robot=robot, constants=shared, by_recording=own)


def _taken(
    model: Model, recordings: Sequence[Recording]
) -> tuple[dict[str, dict[str, float]], dict[str, Constant]]:
    """Constants by path and recording, and those of the robot that say where they are known.

    A value as the model has it is left out, unless the model would refit it.
    """
    own = {path: dict(values) for path, values in model.by_recording.items()}
    constants = dict(model.robot.constants)
    for r in recordings:
        for path, value in r.constants.items():
            constant = _constant(model, r, path, value)
            own.setdefault(path, {}).pop(r.name, None)
            if constant.uncertain or value != model.constants[path]:
                own[path][r.name] = value
                known = constants[path].known | {r.name}
                constants[path] = replace(constants[path], known=known)
    return own, constants


def _agreed(own: Mapping[str, Mapping[str, float]], count: int) -> list[str]:
    """Constants that all of so many recordings know to be the same: one value does for them."""
    return [
        path
        for path, values in own.items()
        if len(values) == count and len(set(values.values())) == 1
    ]


def _constant(model: Model, recording: Recording, path: str, value: float) -> Constant:
    """The constant of the robot that a recording knows."""
    known, where = model.robot.constants.get(path), f'{recording.path}: constants'
    if known is None:
        raise UserError(
            f'{where}: {model.robot.name} has no {path!r}{nearest(path, model.robot.constants)}'
        )
    checked(where, path, Quantity(value=value, unit=known.unit), known.unit)
    return known


def _apart(recordings: Sequence[Recording]) -> None:
    seen: dict[str, Recording] = {}
    for recording in recordings:
        if first := seen.get(recording.name):
            raise UserError(
                f'{first.path} and {recording.path} have one name, by which constants that differ '
                'between recordings go; rename one of them'
            )
        seen[recording.name] = recording
