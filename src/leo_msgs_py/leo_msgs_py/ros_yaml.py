# SPDX-License-Identifier: Apache-2.0
"""YAML as ROS reads parameters: 1e-3 is a number, 2026-01-31 and 1_000 are text."""

from __future__ import annotations

import re
from typing import Any

import yaml

_FLOAT = re.compile(
    r'[-+]?(?:[0-9]+\.[0-9]*|\.[0-9]+|[0-9]+(?=[eE]))(?:[eE][-+]?[0-9]+)?$'
    r'|[-+]?\.(?:inf|Inf|INF)$|\.(?:nan|NaN|NAN)$'
)
_INT = re.compile(r'[-+]?(?:0[xX][0-9a-fA-F]+|0[0-7]*|[1-9][0-9]*)$')
_OURS = ('float', 'int', 'timestamp')


class _Loader(yaml.SafeLoader):
    """PyYAML follows YAML 1.1, in which a float needs a dot and 12:30 is a number."""


_Loader.yaml_implicit_resolvers = {
    first: [(tag, form) for tag, form in known if tag.rpartition(':')[2] not in _OURS]
    for first, known in yaml.SafeLoader.yaml_implicit_resolvers.items()
}
_Loader.add_implicit_resolver('tag:yaml.org,2002:float', _FLOAT, list('-+0123456789.'))
_Loader.add_implicit_resolver('tag:yaml.org,2002:int', _INT, list('-+0123456789'))


def load(text: str) -> Any:
    """The Python value of a YAML text; yaml.YAMLError where it is none."""
    return yaml.load(text, Loader=_Loader)
