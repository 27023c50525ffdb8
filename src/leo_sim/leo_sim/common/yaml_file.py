# SPDX-License-Identifier: Apache-2.0
"""YAML files read through pydantic schemas, with one-line errors."""

from collections import Counter
from pathlib import Path
import reprlib
from typing import Annotated, Any, TypeVar

from pydantic import AfterValidator, BaseModel, BeforeValidator, ConfigDict, Field, ValidationError
import yaml

from leo_msgs_py.errors import UserError
from leo_msgs_py.names import nearest
from leo_msgs_py.terminal import is_name


def _number(value: Any) -> Any:
    if isinstance(value, bool):
        raise ValueError('a number is wanted')
    return value


Finite = Annotated[float, Field(allow_inf_nan=False), BeforeValidator(_number)]
Positive = Annotated[float, Field(gt=0, le=1e12), BeforeValidator(_number)]


def _name(text: str) -> str:
    if not is_name(text):
        raise ValueError('a name is one line of plain text')
    return text


Name = Annotated[str, AfterValidator(_name)]  # one line, in which a terminal would obey nothing


class Schema(BaseModel):
    """A part of a file that knows all its keys."""

    model_config = ConfigDict(extra='forbid')


class Fixed(Schema):
    """A part of a file that knows all its keys, and stays as it was read."""

    model_config = ConfigDict(frozen=True)


class Quantity(Schema):
    """A number with its unit, and the range it is known to lie in."""

    value: Finite
    unit: str
    uncertain: tuple[Finite, Finite] | None = None


S = TypeVar('S', bound=BaseModel)
NO_MAPPING = ('model_type', 'dataclass_type', 'dict_type')
LONGEST = 300_000  # characters of a YAML file: reading more takes minutes
MAPPING = 'must be a mapping of keys to values'


def read(path: Path, schema: type[S]) -> S:
    """The content of a YAML file, checked against a schema.

    UserError, with file, where and what: no such file, no YAML, a wrong or missing value, or an
    unknown key (naming the nearest known one).
    """
    data = parsed(path)
    if not isinstance(data, dict):
        found = 'nothing' if data is None else shown(data)
        keys = ', '.join(schema.model_fields)
        raise UserError(f'{path}: expected a mapping of {keys}, found {found}')
    return check(data, schema, path)


class _Loader(yaml.SafeLoader):
    """YAML in which no mapping has a key twice."""

    def construct_mapping(self, node: yaml.MappingNode, deep: bool = False) -> Any:
        keys = Counter(key.value for key, _ in node.value if isinstance(key, yaml.ScalarNode))
        if twice := [key for key, times in keys.items() if times > 1]:
            raise yaml.YAMLError(f'{twice[0]!r} is there twice')
        return super().construct_mapping(node, deep)


def parsed(path: Path) -> Any:
    """What a YAML file says; UserError: no such file, or no YAML, or a key that is there twice."""
    text = read_text(path)
    if len(text) > LONGEST:
        raise UserError(
            f'{path}: {len(text)} characters, more than the {LONGEST} of any file here'
        )
    try:
        return yaml.load(text, _Loader)
    except RecursionError as error:
        raise UserError(f'{path}: not a YAML file: it is nested too deeply') from error
    except (yaml.YAMLError, ValueError) as error:  # ValueError: a date or number that is none
        raise UserError(f'{path}: not a YAML file: {" ".join(str(error).split())}') from error


def read_text(path: Path) -> str:
    """The text of a file; UserError: it cannot be read, or is not text."""
    try:
        return path.read_text(encoding='utf-8')
    except OSError as error:
        raise UserError(f'cannot read {path}: {error.strerror}') from error
    except UnicodeDecodeError as error:
        raise UserError(f'{path}: not a text file: {error}') from error


def check(data: Any, schema: type[S], path: Path) -> S:
    try:
        return schema.model_validate(data)
    except ValidationError as error:
        raise UserError(f'{path}: {_first_problem(error, schema)}') from error


def _first_problem(error: ValidationError, schema: type[BaseModel]) -> str:
    """What is wrong, of an unknown key first: it is often why another one is missing."""
    problem = min(error.errors(), key=lambda found: found['type'] != 'extra_forbidden')
    where = '.'.join(str(part) for part in problem['loc'])
    if problem['type'] == 'extra_forbidden':
        return f'unknown key {where!r}{nearest(str(problem["loc"][-1]), _keys(schema))}'
    if problem['type'] == 'missing':
        return f'{where}: is missing'
    said = MAPPING if problem['type'] in NO_MAPPING else problem['msg']
    return f'{where}: {said}, found {shown(problem["input"])}'


def _keys(schema: type[BaseModel]) -> set[str]:
    inside = schema.model_json_schema().get('$defs', {}).values()
    return {*schema.model_fields, *(key for part in inside for key in part.get('properties', {}))}


def shown(value: Any) -> str:
    """A value from a file in a few words, however large it is."""
    return ' '.join(reprlib.repr(value).split())
