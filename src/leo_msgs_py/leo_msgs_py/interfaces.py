# SPDX-License-Identifier: Apache-2.0
"""Message and service classes by the names that the graph and the command line give them."""

from __future__ import annotations

from importlib import import_module
from importlib.util import find_spec
from pathlib import Path
import re
from typing import Any

from leo_msgs_py.errors import UserError

_NAME = re.compile(r'([a-z]\w*)/(?:(msg|srv|action)/)?([A-Z]\w*)', re.ASCII)


def load(name: str, kind: str = 'msg') -> Any:
    """Class of a message 'pkg/msg/Name' or service 'pkg/srv/Name'; 'pkg/Name' is one of `kind`.

    Raises:
        UserError: it is no such name, or the package with its type support is not installed.
    """
    found = _NAME.fullmatch(name)
    package, folder, leaf = found.groups() if found else ('', '', '')
    try:
        if not found or not _has(package, folder or kind):
            raise ImportError
        return getattr(import_module(f'{package}.{folder or kind}'), leaf)
    except (ImportError, AttributeError, ValueError) as error:
        raise UserError(
            f'no type {name!r} is installed; write for example std_msgs/msg/String'
        ) from error


def _has(package: str, folder: str) -> bool:
    """Whether a package holds interfaces; others may do anything when they are imported."""
    spec = find_spec(package)
    places = spec.submodule_search_locations if spec else None
    return any(Path(place, folder).is_dir() for place in places or ())
