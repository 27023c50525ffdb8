# SPDX-License-Identifier: Apache-2.0
"""YAML files from users, checked, with one clear line for what is wrong."""

from __future__ import annotations

import difflib
from pathlib import Path
from typing import Any, TypeVar

from pydantic import BaseModel, ValidationError

from leo_msgs_py.errors import UserError
from leo_sim.common.yaml_file import parsed, shown

Config = TypeVar('Config', bound=BaseModel)


def read_config(path: Path, model: type[Config]) -> Config:
    """Read a YAML file into a pydantic model.

    Raises:
        UserError: no such file, no YAML, an unknown key (naming the nearest known one) or a
            wrong value.
    """
    if not path.is_file():
        raise UserError(f'no file {path}')
    content = parsed(path)
    if not isinstance(content, dict):
        raise UserError(f'{path}: expected a mapping of {", ".join(model.model_fields)}')
    return parse_config(content, model, str(path))


def parse_config(content: dict[str, Any], model: type[Config], where: str) -> Config:
    """Check a mapping against a pydantic model; `where` opens the error line."""
    try:
        return model.model_validate(content)
    except ValidationError as error:
        raise UserError(f'{where}: {_first_problem(error, model)}') from None


def _first_problem(error: ValidationError, model: type[BaseModel]) -> str:
    problems = error.errors()
    problem = min(problems, key=lambda found: found['type'] != 'extra_forbidden')
    place = '.'.join(str(part) for part in problem['loc'])
    if problem['type'] == 'extra_forbidden':
        return f'unknown key {place!r}{nearest(str(problem["loc"][-1]), _keys(model))}'
    return f'{place}: {problem["msg"]}, found {shown(problem["input"])}'


def _keys(model: type[BaseModel]) -> list[str]:
    """Return the keys of a model and of the models inside it."""
    keys = list(model.model_fields)
    for value in model.model_json_schema().get('$defs', {}).values():
        keys.extend(value.get('properties', {}))
    return keys


def nearest(name: str, known: list[str]) -> str:
    """Return ' (did you mean ...?)' or a list of what is known."""
    close = difflib.get_close_matches(name, known, n=1)
    if close:
        return f'; did you mean {close[0]!r}?'
    return f'; known: {", ".join(sorted(known))}'
