# SPDX-License-Identifier: Apache-2.0
"""model.yaml: a robot with its effects, constants, difference model and history."""

from collections.abc import Mapping, Sequence
from dataclasses import replace
import os
from pathlib import Path
from typing import Annotated, Any

from pydantic import AfterValidator, Field
import yaml

from leo_msgs_py.errors import UserError
from leo_msgs_py.names import look_up, nearest
from leo_msgs_py.whole_file import write_whole
from leo_sim.common.consent import require
from leo_sim.common.yaml_file import Finite, read, Schema
from leo_sim.description.robot import load_robot, named_robots, Robot
from leo_sim.effects import check_bounds, get_effect, place, Placed
from leo_sim.effects.parameter import has_unit, Parameter
from leo_sim.model.constants import changed_constants, checked_constants, ConstantFile, expanded
from leo_sim.model.model import Model

_Entries = Sequence[Mapping[str, Any]] | None  # of a history
Limits = dict[str, tuple[float, float]]


def _ordered(interval: tuple[float, float]) -> tuple[float, float]:
    if interval[0] > interval[1]:
        raise ValueError('the lower bound comes first')
    return interval


class ParameterFile(Schema):
    value: Finite
    unit: str
    ci95: Annotated[tuple[Finite, Finite], AfterValidator(_ordered)] | None = None


class EffectFile(Schema):
    name: str
    where: str | list[str]
    parameters: dict[str, ParameterFile] = Field(default_factory=dict)


class LimitFile(Schema):
    range: tuple[Finite, Finite]
    unit: str


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


def limit_keys(effect: str, where: str, parameter: str) -> tuple[str, str]:
    """How `limits` names a parameter at one place, and at all of them."""
    return f'{effect}:{where}.{parameter}', f'{effect}.{parameter}'


def load_model(ref: str | Path, engine: str = 'pybullet') -> Model:
    """A model from model.yaml, a robot's or a shipped model's name, or a robot folder.

    UserError: one line with file, place and what is wrong; a Python file in it that the user has
    not named (see `common.consent`).
    """
    path = _named_file(ref)
    if not os.path.isfile(path):  # False for a name that no file can have, too
        if path.suffix in ('.yaml', '.yml'):
            raise UserError(f'no model file {path}')
        return Model(load_robot(ref), engine=engine)
    file = read(path, ModelFile)
    robot = load_robot(_robot_of(path, file.robot))
    constants = expanded(robot, file.constants)
    robot = robot.with_constants(checked_constants(path, robot, constants))
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
    found = {name: folder.glob('models/*.yaml') for name, folder in named_robots().items()}
    return {f'{name}_{file.stem}': file for name, of in found.items() for file in sorted(of)}


def load_effects(path: str | Path, robot: Robot) -> tuple[Placed, ...]:
    """The effects of a file with an `effects:` list, placed on a robot; UserError as above."""
    return _placed_all(Path(path), robot, read(Path(path), _EffectsFile).effects)


def write_effects(effects: Sequence[Placed], folder: Path | None = None) -> list[dict[str, Any]]:
    """An `effects:` list as YAML takes it; effect files are named relative to `folder`."""
    return [_entry(placed, folder) for placed in effects]


def save_model(path: str | Path, model: Model, history: _Entries = None) -> Path:
    """Write a model, with single values for all parameters, as a new file.

    The history is what was added and why; the model's own when None. UserError: the file exists;
    OSError: it cannot be written.
    """
    path = Path(path)
    if path.exists():
        raise UserError(f'{path} exists; a model is always written to a new file')
    return write_whole(path, model_text(path, model, history))


def model_text(path: Path, model: Model, history: _Entries = None) -> str:
    content: dict[str, Any] = {'robot': _reference(path, model.robot)}
    if changed := changed_constants(model.robot, model.constants, model.by_recording):
        content['constants'] = changed
    if model.effects:
        content['effects'] = write_effects(model.effects, path.parent)
    if model.limits:
        content['limits'] = {
            key: {'range': [float(v) for v in ends], 'unit': _limited(model.robot, key)[1].unit}
            for key, ends in model.limits.items()
        }
    if model.difference_model is not None:
        content['difference_model'] = str(_relative(model.difference_model, path.parent))
    if entries := [dict(h) for h in (model.history if history is None else history)]:
        content['history'] = entries
    return yaml.safe_dump(content, sort_keys=False, allow_unicode=True)


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
    place = 'all' if placed.everywhere else where
    return {'name': source or placed.effect.name, 'where': place, 'parameters': parameters}


def _placed_all(path: Path, robot: Robot, entries: Sequence[EffectFile]) -> tuple[Placed, ...]:
    require((_named(path, entry) for entry in entries), path)
    return tuple(_placed(path, f'effects[{i}]', robot, e) for i, e in enumerate(entries))


def _placed(path: Path, at: str, robot: Robot, entry: EffectFile) -> Placed:
    values = {key: p.value for key, p in entry.parameters.items()}
    try:
        effect = get_effect(_named(path, entry))
        placed = place(robot, effect, entry.where, **values)
        for p in effect.parameters_for(robot, placed.where):
            given = entry.parameters.get(p.name)
            if given is not None and not has_unit(robot, placed.where, p, given.unit):
                raise UserError(
                    f'{entry.name}.{p.name}: the unit is {p.unit!r}, found {given.unit!r}'
                )
        check_bounds(robot, placed)
    except UserError as error:
        raise UserError(f'{path}: {at}: {error}') from error
    intervals = {key: p.ci95 for key, p in entry.parameters.items() if p.ci95 is not None}
    return replace(placed, ci95=intervals)


def _named(path: Path, entry: EffectFile) -> str:
    return _near(path, entry.name) if entry.name.endswith('.py') else entry.name


def _named_file(ref: str | Path) -> Path:
    """The file of a shipped model by its name, else what is there by that name."""
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


def _limits(path: Path, robot: Robot, given: Mapping[str, LimitFile]) -> Limits:
    """Ranges by `effect.parameter` or `effect:where.parameter`; each has room for no effect."""
    try:
        return {key: _checked_limit(robot, key, limit) for key, limit in given.items()}
    except UserError as error:
        raise UserError(f'{path}: {error}') from error


def _checked_limit(robot: Robot, key: str, limit: LimitFile) -> tuple[float, float]:
    (places, parameter), (low, high) = _limited(robot, key), limit.range
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


def _limited(robot: Robot, key: str) -> tuple[tuple[str, ...], Parameter]:
    """The places and the parameter that a key names."""
    label, _, name = key.rpartition('.')
    effect_name, _, where = label.partition(':')
    effect = get_effect(effect_name)
    places = effect.places(robot)
    if where not in ('', 'all'):
        if where not in places:
            near = nearest(where, places)
            raise UserError(f'limits: {key}: {effect.name} does not act there{near}')
        places = (where,)
    known = {p.name: p for p in effect.parameters_for(robot, places)}
    return places, look_up(name, known, f'limits: {effect_name} has no')


def _near(path: Path, ref: str) -> str:
    """A reference in a file: relative paths count from the file's folder."""
    near = path.parent / ref
    return str(near) if os.path.exists(near) else ref


def _robot_of(path: Path, ref: str) -> str:
    """The folder or the name of a model file's robot."""
    found, robots = _near(path, ref), named_robots()
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
