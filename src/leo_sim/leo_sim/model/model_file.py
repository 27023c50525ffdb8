# SPDX-License-Identifier: Apache-2.0
"""model.yaml: a robot with its effects, constants, difference model and history."""

from collections.abc import Mapping, Sequence
from dataclasses import replace
from fnmatch import fnmatchcase
import os
from pathlib import Path
from typing import Any

from pydantic import Field
import yaml

from leo_msgs_py.errors import UserError
from leo_sim.common.names import nearest
from leo_sim.common.yaml_file import Finite, Quantity, read, Schema
from leo_sim.description.constants import checked
from leo_sim.description.robot import Constant, load_robot, named_robots, Robot
from leo_sim.effects import check_bounds, get_effect, place, Placed
from leo_sim.effects.consent import require
from leo_sim.effects.parameter import has_unit
from leo_sim.model.limits_file import checked_limits, limited_parameter, LimitFile, Limits
from leo_sim.model.model import Model


class ParameterFile(Schema):
    """A value of an effect's parameter, with its 95 % confidence interval."""

    value: Finite
    unit: str
    ci95: tuple[Finite, Finite] | None = None


class ConstantFile(Quantity):
    """A constant; it may have a value of its own in each recording.

    Attributes:
        per_recording: Each recording's value is refitted by itself, within `uncertain`.
        recordings: Values by the name of the recording: known, or where `per_recording` starts.
    """

    per_recording: bool = False
    recordings: dict[str, Finite] = Field(default_factory=dict)


class EffectFile(Schema):
    """An effect and where it acts."""

    name: str
    where: str | list[str]
    parameters: dict[str, ParameterFile] = Field(default_factory=dict)


class ModelFile(Schema):
    """model.yaml (docs/reference/contracts.md 5)."""

    robot: str
    constants: dict[str, ConstantFile] = Field(default_factory=dict)
    effects: tuple[EffectFile, ...] = ()
    limits: dict[str, LimitFile] = Field(default_factory=dict)
    difference_model: str | None = None
    history: tuple[dict[str, Any], ...] = ()


class _EffectsFile(Schema):
    """An `effects:` list alone, or as `leo reveal --json` prints it, or a model file's."""

    effects: tuple[EffectFile, ...]
    robot: str | None = None
    history: tuple[dict[str, Any], ...] = ()


def load_model(ref: str | Path, engine: str = 'pybullet') -> Model:
    """A model from model.yaml, a robot's or a shipped model's name, or a robot folder.

    Args:
        ref: File, name or folder.
        engine: See `Model`.

    Raises:
        UserError: One line with file, place and what is wrong; a Python file in it that the user
            has not named (see `effects.consent`).
    """
    path = _named_file(ref)
    if not os.path.isfile(path):  # False for a name that no file can have, too
        if path.suffix in ('.yaml', '.yml'):
            raise UserError(f'no model file {path}')
        return Model(load_robot(ref), engine=engine)
    file = read(path, ModelFile)
    robot = load_robot(_robot_of(path, file.robot))
    constants = _each(path, robot, file.constants)
    robot = robot.with_constants(_constants(path, robot, constants))
    difference = file.difference_model
    return Model(
        robot,
        _placed_all(path, robot, file.effects),
        engine=engine,
        history=file.history,
        limits=_limits(path, robot, file.limits),
        by_recording={name: c.recordings for name, c in constants.items()},
        difference_model=None if difference is None else path.parent / difference,
    )


def named_models() -> dict[str, Path]:
    """The model files in the folders `models` of named robots: ROBOT_FILE, as so101_bam."""
    return {
        f'{name}_{file.stem}': file
        for name, folder in named_robots().items()
        for file in sorted(folder.glob('models/*.yaml'))
    }


def load_effects(path: str | Path, robot: Robot) -> tuple[Placed, ...]:
    """The effects of a file with an `effects:` list, placed on a robot.

    Raises:
        UserError: One line with file, place and what is wrong.
    """
    return _placed_all(Path(path), robot, read(Path(path), _EffectsFile).effects)


def write_effects(effects: Sequence[Placed], folder: Path | None = None) -> list[dict[str, Any]]:
    """An `effects:` list as YAML takes it; effect files in `folder` are named relative to it."""
    return [_entry(placed, folder) for placed in effects]


def save_model(
    path: str | Path, model: Model, history: Sequence[Mapping[str, Any]] | None = None
) -> Path:
    """Write a model as a new file.

    Args:
        path: A file that does not exist yet.
        model: With single values for all parameters.
        history: Entries of what was added and why; the model's own when None.

    Raises:
        UserError: The file exists.
    """
    path = Path(path)
    content: dict[str, Any] = {'robot': _reference(path, model.robot)}
    if changed := _changed_constants(model):
        content['constants'] = changed
    if model.effects:
        content['effects'] = write_effects(model.effects, path.parent)
    if model.limits:
        content['limits'] = _written_limits(model)
    if model.difference_model is not None:
        content['difference_model'] = str(_relative(model.difference_model, path.parent))
    if entries := [dict(h) for h in (model.history if history is None else history)]:
        content['history'] = entries
    try:
        with path.open('x', encoding='utf-8') as file:
            yaml.safe_dump(content, file, sort_keys=False, allow_unicode=True)
    except FileExistsError as error:
        raise UserError(f'{path} exists; a model is always written to a new file') from error
    except OSError as error:
        raise UserError(f'cannot write {path}: {error.strerror}') from error
    return path


def _entry(placed: Placed, folder: Path | None) -> dict[str, Any]:
    parameters: dict[str, Any] = {}
    for name, value in placed.parameters.items():
        parameters[name] = {'value': float(value), 'unit': placed.units[name]}
        if name in placed.ci95:
            parameters[name]['ci95'] = [float(v) for v in placed.ci95[name]]
    where: Any = list(placed.where) if len(placed.where) > 1 else placed.where[0]
    source = placed.effect.source
    if source and folder is not None:
        source = str(_relative(Path(source), folder))
    return {
        'name': source or placed.effect.name,
        'where': 'all' if placed.everywhere else where,
        'parameters': parameters,
    }


def _placed_all(path: Path, robot: Robot, entries: Sequence[EffectFile]) -> tuple[Placed, ...]:
    require((_named(path, entry) for entry in entries), path)
    return tuple(_placed(path, f'effects[{i}]', robot, e) for i, e in enumerate(entries))


def _placed(path: Path, at: str, robot: Robot, entry: EffectFile) -> Placed:
    values = {key: p.value for key, p in entry.parameters.items()}
    try:
        effect = get_effect(_named(path, entry))
        placed = place(robot, effect, entry.where, **values)
        _check(robot, placed, entry)
    except UserError as error:
        raise UserError(f'{path}: {at}: {error}') from error
    intervals = {key: p.ci95 for key, p in entry.parameters.items() if p.ci95 is not None}
    return replace(placed, ci95=intervals)


def _named(path: Path, entry: EffectFile) -> str:
    return _beside(path, entry.name) if entry.name.endswith('.py') else entry.name


def _check(robot: Robot, placed: Placed, entry: EffectFile) -> None:
    """Raise UserError for a wrong unit or a value outside the physical bounds."""
    for p in placed.effect.parameters_for(robot, placed.where):
        given = entry.parameters.get(p.name)
        if given is None:
            continue
        if not has_unit(robot, placed.where, p, given.unit):
            raise UserError(f'{entry.name}.{p.name}: the unit is {p.unit!r}, found {given.unit!r}')
    check_bounds(robot, placed)


def _named_file(ref: str | Path) -> Path:
    """The file of a shipped model by its name, else what is there by that name.

    Raises:
        UserError: Nothing is, and no robot or model has that name; the nearest one.
    """
    path, name = Path(ref), str(ref)
    if os.path.exists(path) or path.suffix in ('.yaml', '.yml'):
        return path
    models, robots = named_models(), named_robots()
    if name not in robots and name not in models:
        raise UserError(
            f'no robot or model is named {name!r}, and it is no folder'
            f'{nearest(name, {**robots, **models})}'
        )
    return models.get(name, path)


def _each(path: Path, robot: Robot, given: Mapping[str, ConstantFile]) -> dict[str, ConstantFile]:
    """Constants by their whole paths: `actuators.*.resistance` stands for each of them.

    What a file says of one of them holds for that one, wherever it says so.

    Raises:
        UserError: The robot has none of them.
    """
    result: dict[str, ConstantFile] = {}
    for pattern in (name for name in given if '*' in name):
        found = [name for name in robot.constants if fnmatchcase(name, pattern)]
        if not found:
            raise UserError(
                f'{path}: constants: {robot.name} has no {pattern!r}'
                f'{nearest(pattern, robot.constants)}'
            )
        result |= dict.fromkeys(found, given[pattern])
    return result | {name: c for name, c in given.items() if '*' not in name}


def _constants(path: Path, robot: Robot, given: Mapping[str, ConstantFile]) -> dict[str, Constant]:
    result = {}
    for name, quantity in given.items():
        known = robot.constants.get(name)
        if known is None:
            raise UserError(
                f'{path}: constants: {robot.name} has no {name!r}{nearest(name, robot.constants)}'
            )
        result[name] = _constant(path, name, quantity, known)
    return result


def _constant(path: Path, name: str, given: ConstantFile, known: Constant) -> Constant:
    where, uncertain = f'{path}: constants', given.uncertain or known.uncertain
    if given.per_recording and uncertain is None:
        raise UserError(
            f'{where}: {name}: per_recording refits it, so say in which range: '
            'uncertain: [low, high]; known values go under recordings alone'
        )
    for recording, value in given.recordings.items():
        own = Quantity(
            value=value, unit=given.unit, uncertain=uncertain if given.per_recording else None
        )
        checked(f'{where}: recordings: {recording}', name, own, known.unit)
    whole = Quantity(value=given.value, unit=given.unit, uncertain=uncertain)
    sure = frozenset() if given.per_recording else frozenset(given.recordings)
    return replace(
        checked(where, name, whole, known.unit), per_recording=given.per_recording, known=sure
    )


def _limits(path: Path, robot: Robot, given: Mapping[str, LimitFile]) -> Limits:
    try:
        return checked_limits(robot, given)
    except UserError as error:
        raise UserError(f'{path}: {error}') from error


def _written_limits(model: Model) -> dict[str, Any]:
    units = {key: limited_parameter(model.robot, key).unit for key in model.limits}
    return {
        key: {'range': [float(v) for v in ends], 'unit': units[key]}
        for key, ends in model.limits.items()
    }


def _changed_constants(model: Model) -> dict[str, Any]:
    """Constants that differ from the robot's files."""
    original = load_robot(model.robot.folder).constants
    changed: dict[str, Any] = {}
    for name, constant in model.robot.constants.items():
        entry: dict[str, Any] = {'value': float(model.constants[name]), 'unit': constant.unit}
        if constant.uncertain is not None:
            entry['uncertain'] = list(constant.uncertain)
        if constant.per_recording:
            entry['per_recording'] = True
        if own := model.by_recording.get(name):
            entry['recordings'] = {recording: float(value) for recording, value in own.items()}
        if entry != _as_in_files(original[name]):
            changed[name] = entry
    return changed


def _as_in_files(constant: Constant) -> dict[str, Any]:
    entry: dict[str, Any] = {'value': constant.value, 'unit': constant.unit}
    return entry if constant.uncertain is None else entry | {'uncertain': [*constant.uncertain]}


def _beside(path: Path, ref: str) -> str:
    """A reference in a file: relative paths count from the file's folder."""
    near = path.parent / ref
    return str(near) if os.path.exists(near) else ref


def _robot_of(path: Path, ref: str) -> str:
    """The folder or the name of a model file's robot.

    Raises:
        UserError: It is neither.
    """
    found, robots = _beside(path, ref), named_robots()
    if not os.path.isdir(found) and ref not in robots:
        raise UserError(
            f'{path}: robot: no robot is named {ref!r}, and there is no folder '
            f'{path.parent / ref}{nearest(ref, robots)}; a robot folder goes there, '
            'or the file says where it is'
        )
    return found


def _reference(path: Path, robot: Robot) -> str:
    """How model.yaml names a robot: by its name where it has one, else by its folder."""
    for name, folder in named_robots().items():
        if folder.resolve() == robot.folder.resolve():
            return name
    return str(_relative(robot.folder, path.parent))


def _relative(target: Path, folder: Path) -> Path:
    """The way from a folder to a file or folder, so that both can move together.

    Absolute where they have nothing in common but the root.
    """
    resolved, base = target.resolve(), folder.resolve()
    common = Path(os.path.commonpath([resolved, base]))
    return resolved if common == Path(common.anchor) else Path(os.path.relpath(resolved, base))
