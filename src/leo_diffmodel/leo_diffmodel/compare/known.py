# SPDX-License-Identifier: Apache-2.0
"""What is known of data and model: constants of the robot as recorded, where results come from."""

from dataclasses import replace
import datetime
import hashlib
from importlib.metadata import version
import json
from pathlib import Path
import platform
import shlex
import sys

from leo_diffmodel.bags.recording import Recording, Recordings
from leo_msgs_py.errors import UserError
from leo_msgs_py.names import nearest
from leo_sim.common.yaml_file import Quantity
from leo_sim.description.constants import checked, Constant
from leo_sim.model import Model


def with_known(model: Model, recordings: Recordings) -> Model:
    """The model with the constants that recordings know of themselves, in place of its own.

    What a recording knows is not refitted in it, also where the model calls it uncertain.
    UserError of a constant or a value that the robot cannot have, and of two recordings of one
    name, as such constants are kept by the recordings' names.
    """
    own, constants = _taken(model, recordings)
    if any(own.values()) or any(c.per_recording for c in constants.values()):
        _apart(recordings)
    if not any(r.constants for r in recordings):
        return model
    robot, shared = model.robot.with_constants(constants), dict(model.constants)
    if robot.contacts:  # one value serves them all where all know the same
        every = [path for path, values in own.items() if len(values) == len(recordings)]
        agreed = [path for path in every if len({*own[path].values()}) == 1]
        shared |= {path: own.pop(path).popitem()[1] for path in agreed}
    return model.changed(robot=robot, constants=shared, by_recording=own)


def _taken(
    model: Model, recordings: Recordings
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


def _constant(model: Model, recording: Recording, path: str, value: float) -> Constant:
    """The constant of the robot that a recording knows."""
    known, where = model.robot.constants.get(path), f'{recording.path}: constants'
    if known is None:
        raise UserError(
            f'{where}: {model.robot.name} has no {path!r}{nearest(path, model.robot.constants)}'
        )
    checked(where, path, Quantity(value=value, unit=known.unit), known.unit)
    return known


def _apart(recordings: Recordings) -> None:
    seen: dict[str, Recording] = {}
    for recording in recordings:
        if first := seen.get(recording.name):
            raise UserError(
                f'{first.path} and {recording.path} have one name, by which constants that differ '
                'between recordings go; rename one of them'
            )
        seen[recording.name] = recording


PACKAGES = ('leo_sim', 'leo_diffmodel', 'numba', 'numpy', 'scipy')


def provenance(recordings: Recordings, model: Model) -> dict:
    """Bags with their hashes, the model, versions, the command line and the date."""
    return {
        'bags': [_bag(r) for r in recordings],
        'robot': model.robot.name,
        'model_sha256': _digest(model),
        'effects_in_model': [p.effect.name for p in model.effects],
        'command': shlex.join([_program(sys.argv[0]), *sys.argv[1:]]),
        'date': datetime.datetime.now(datetime.UTC).isoformat(timespec='seconds'),
        'python': platform.python_version(),
        'versions': {name: version(name) for name in PACKAGES},
        'seed': 0,
    }


def _program(path: str) -> str:
    """The program as a person types it: leo, also where Python ran it another way."""
    return 'leo' if path in ('-c', '-m') or Path(path).name in ('leo', 'cli.py') else path


def _bag(recording: Recording) -> dict:
    known = {'constants': dict(recording.constants)} if recording.constants else {}
    return {'path': str(recording.path), 'sha256': recording.sha256, **known}


def _digest(model: Model) -> str:
    """Hash of the physics: the tree, every constant, every effect with its values."""
    effects = [(p.effect.name, p.where, dict(p.parameters)) for p in model.effects]
    parts = [model.robot.urdf, model.constants, effects]
    parts += [model.by_recording] if model.by_recording else []
    return hashlib.sha256(json.dumps(parts, sort_keys=True, default=float).encode()).hexdigest()
