# SPDX-License-Identifier: Apache-2.0
"""What `leo add` takes from an explain.json."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

from pydantic import BaseModel

from leo_msgs_py.errors import UserError
from leo_sim.common.yaml_file import check, Finite, read_text


class _Value(BaseModel):
    value: Finite
    unit: str | None = None


class _Constant(_Value):
    recordings: dict[str, _Value] = {}


class _Parameter(_Value):
    ci95: tuple[Finite, Finite]


class _Placed(BaseModel):
    name: str
    where: str | list[str]
    source: str | None = None
    parameters: dict[str, _Parameter]


class _Effect(_Placed):
    error_before: Any
    error_after: Any


class _Whole(BaseModel):
    effects: list[_Placed]
    constants: dict[str, _Constant]


class _Law(BaseModel):
    """What is no known effect, where an effect file was written of it."""

    model: _Whole
    source: str
    joint: str
    error_before: Any
    error_after: Any


class _Provenance(BaseModel):
    robot: str
    bags: Any
    date: str


class _ExplanationFile(BaseModel):
    verdict: str
    effects: list[_Effect]
    constants: dict[str, _Constant]
    provenance: _Provenance
    unknown: dict[str, Any] | None = None


def read_explanation(path: Path) -> dict[str, Any]:
    """The content of an explain.json, all that is needed from it there and of its type.

    Raises:
        UserError: no such file, no JSON, or no explain.json: file, where, what.
    """
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
