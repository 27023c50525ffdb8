# SPDX-License-Identifier: Apache-2.0
"""Add effects to a model: from explain.json, or from words on the command line."""

from collections.abc import Mapping, Sequence
from dataclasses import replace
import datetime
import json
from pathlib import Path
from typing import Any

from pydantic import BaseModel

from leo_msgs_py.errors import UserError
from leo_sim.common.consent import require
from leo_sim.common.yaml_file import check, Finite, Quantity, read_text
from leo_sim.description.constants import checked
from leo_sim.effects import check_bounds, EFFECTS, get_effect, place, Placed, registered_effects
from leo_sim.model import Model


def from_explanation(
    model: Model, source: str | Path, sibling: bool = False
) -> tuple[Model, list[dict]]:
    """As `from_data`, from the path of an explain.json; UserError also where it is none."""
    return from_data(model, read_explanation(Path(source)), source, sibling)


def from_data(
    model: Model, data: dict[str, Any], source: str | Path, sibling: bool = False
) -> tuple[Model, list[dict]]:
    """The model with the effects and refitted constants of an explain.json, and its history.

    Where an effect file was written of what is no known effect, that is added too. With `sibling`
    the model may be of another robot that has the same places; constants that it does not have
    are left out. Errors call the data `source`.

    UserError: another robot, a place or a unit that this robot does not have, nothing named in
    it, or a Python file that may not run.
    """
    robot = data['provenance']['robot']
    if robot != model.robot.name and not sibling:
        raise UserError(
            f'{source} explains {robot!r}, the model is of {model.robot.name!r}; '
            '--robot in place of MODEL moves it there'
        )
    whole = (data.get('unknown') or {}).get('model', data)
    if not whole['effects']:
        hint = '; leo explain … --write-effect FILE.py makes one' if data.get('unknown') else ''
        raise UserError(
            f'{source} names no effect (verdict {data["verdict"]}): nothing to add{hint}'
        )
    found = found_rows(whole)
    require(map(_file_or_name, found), source)
    placed = [_placed(model, row) for row in found]
    refitted = {k: c for k, c in whole['constants'].items() if k in model.constants or not sibling}
    moved = {'moved_from': robot} if robot != model.robot.name else {}
    entries = [entry | moved for entry in history(data)]
    return _refitted(changed(model, placed), source, refitted), entries


def from_words(model: Model, words: Sequence[str]) -> tuple[Model, list[dict]]:
    """The model with effects given as EFFECT[:WHERE] PARAM=VALUE …, one after the other.

    UserError: unknown effect, place or parameter, no value or none within physical bounds.
    """
    added = []
    for word, *values in _each(words):
        name, _, where = word.partition(':')
        parameters = dict(_assignment(value) for value in values)
        if len(parameters) < len(values):
            given = ' '.join((word, *values))
            raise UserError(f'{given}: a parameter is given twice; give it once')
        model, entries = by_name(model, name, where or 'all', parameters, word)
        added += entries
    return model, added


def by_name(
    model: Model,
    name: str,
    where: str | Sequence[str],
    parameters: Mapping[str, float],
    added: str = '',
) -> tuple[Model, list[dict]]:
    """The model with one effect, by its name or Python file, and its history; see `from_words`.

    Parameters are in the effect's units; `added` is what the history calls it.
    """
    several = where if isinstance(where, str) else list(where)
    added = added or f'{name}:{several}'
    placed = place(model.robot, get_effect(name), several, **parameters)
    if not parameters:
        wanted = ' '.join(f'{p}=VALUE [{u}]' for p, u in placed.units.items())
        raise UserError(f'{added} without a value changes nothing; say {wanted}')
    check_bounds(model.robot, placed)
    today = datetime.datetime.now(datetime.UTC).isoformat(timespec='seconds')
    return changed(model, [placed]), [{'added': added, 'by': 'hand', 'date': today}]


def _each(words: Sequence[str]) -> list[list[str]]:
    groups: list[list[str]] = []
    for word in words:
        if not groups or _names_effect(word):
            groups.append([])
        groups[-1].append(word)
    return groups


def _names_effect(word: str) -> bool:
    """Whether a word is an effect, with its place or without, and no parameter."""
    if '=' in word or ':' in word or word.endswith('.py'):
        return '=' not in word
    return word in {*EFFECTS, *(effect.name for effect in registered_effects())}


def changed(model: Model, placed: Sequence[Placed]) -> Model:
    """A model with more effects; a difference model was fitted without them and is left out."""
    return model.changed(effects=(*model.effects, *placed), difference_model=None)


def _refitted(model: Model, source: str | Path, given: Mapping[str, dict[str, Any]]) -> Model:
    """A model with the constants of an explain.json; of those by recording, with each one's."""
    shared = dict(model.constants)
    by_recording = {path: dict(values) for path, values in model.by_recording.items()}
    for path, row in given.items():
        for name, value in row.get('recordings', {}).items():
            by_recording.setdefault(path, {})[name] = _constant(model, source, path, value)
        if not row.get('recordings'):
            shared[path] = _constant(model, source, path, row)
    return model.changed(constants=shared, by_recording=by_recording)


def found_rows(answer: Mapping[str, Any]) -> list[dict[str, Any]]:
    """All effects that an explain.json has fitted together, sure or not."""
    return [*answer['effects'], *answer.get('not_sure', [])]


def history(explanation: dict) -> list[dict]:
    """History entries of an explain.json: what was added, from which bags, with which result."""
    origin = explanation['provenance']
    added = [(f'{row["name"]}:{row["where"]}', row) for row in found_rows(explanation)]
    unknown = explanation.get('unknown') or {}
    if 'model' in unknown:
        added.append((f'{unknown["source"]}:{unknown["joint"]}', unknown))
    return [
        {
            'added': what,
            'bags': origin['bags'],
            'date': origin['date'],
            'error_before': row['error_before'],
            'error_after': row['error_after'],
        }
        for what, row in added
    ]


def _placed(model: Model, row: dict[str, Any]) -> Placed:
    values = {name: p['value'] for name, p in row['parameters'].items()}
    placed = place(model.robot, _file_or_name(row), row['where'], **values)
    for name, p in row['parameters'].items():
        if (unit := p.get('unit')) not in (None, placed.units[name]):
            label = f'{row["name"]}:{row["where"]}'
            raise UserError(
                f'{label} has {name} in {unit}, here it is in {placed.units[name]}; it cannot move'
            )
    check_bounds(model.robot, placed)
    return replace(placed, ci95={name: tuple(p['ci95']) for name, p in row['parameters'].items()})


def _constant(model: Model, source: str | Path, path: str, given: dict[str, Any]) -> float:
    """A refitted constant; `Model` says which ones the robot does not have."""
    value = float(given['value'])
    if (known := model.robot.constants.get(path)) is not None:
        unit = known.unit if given.get('unit') is None else given['unit']
        checked(f'{source}: constants', path, Quantity(value=value, unit=unit), known.unit)
    return value


def _file_or_name(row: dict[str, Any]) -> str:
    return str(row.get('source') or row['name'])


def _assignment(word: str) -> tuple[str, float]:
    name, _, value = word.partition('=')
    try:
        return name, float(value)
    except ValueError:
        other = '' if '=' in word else f'; and no effect is named {name!r}'
        what = f'{word!r}: write PARAM=VALUE with a number, e.g. c=0.002{other}'
        raise UserError(what) from None


class _Value(BaseModel):
    value: Finite
    unit: str | None = None


class _Constant(_Value):
    recordings: dict[str, _Value] = {}


class _Parameter(_Value):
    ci95: tuple[Finite, Finite]


class _Place(BaseModel):
    name: str
    where: str | list[str]


class _Rival(_Place):
    separable_nats: Finite
    same_thing: str | None = None


class _PlacedRow(_Place):
    source: str | None = None
    parameters: dict[str, _Parameter]


class _Effect(_PlacedRow):
    error_before: Any
    error_after: Any
    confusable_with: list[_Rival]


class _Whole(BaseModel):
    effects: list[_PlacedRow]
    constants: dict[str, _Constant]


class _Law(BaseModel):
    """What is no known effect, where an effect file was written of it."""

    model: _Whole
    source: str
    joint: str
    error_before: Any
    error_after: Any


class _Bag(BaseModel):
    sha256: str


class _Provenance(BaseModel):
    robot: str
    bags: list[_Bag]
    date: str


class _ExplanationFile(BaseModel):
    verdict: str
    effects: list[_Effect]
    not_sure: list[_Effect] = []
    constants: dict[str, _Constant]
    provenance: _Provenance
    not_testable: list[_Place]
    unknown: dict[str, Any] | None = None


def read_explanation(path: Path) -> dict[str, Any]:
    """The content of an explain.json, by its path or its folder, of the form that is needed.

    UserError: no such file, no JSON, or no explain.json: file, where, what.
    """
    path = path / 'explain.json' if path.is_dir() else path
    if not path.is_file():
        raise UserError(f'no file {path}; run leo explain … -o DIR first')
    try:
        data = json.loads(read_text(path))
    except (ValueError, RecursionError) as error:
        raise UserError(f'{path} is not JSON: {error}') from error
    if not isinstance(data, dict) or not {'verdict', 'effects', 'provenance'} <= data.keys():
        raise UserError(f'{path} is not an explain.json; leo explain … -o DIR writes one')
    check(data, _ExplanationFile, path)
    if 'model' in (data.get('unknown') or {}):
        check(data['unknown'], _Law, path)
    return data
