# SPDX-License-Identifier: Apache-2.0
"""Message and service classes by the names that the graph and the command line give them."""

from __future__ import annotations

from importlib import import_module
from typing import Any

from leo_msgs_py.errors import UserError


def load(name: str, kind: str = 'msg') -> Any:
    """Class of a message 'pkg/msg/Name' or service 'pkg/srv/Name'; 'pkg/Name' is one of `kind`.

    Raises:
        UserError: it is no such name, or the package with its type support is not installed.
    """
    package, _, rest = name.partition('/')
    folder, _, leaf = rest.rpartition('/')
    try:
        return getattr(import_module(f'{package}.{folder or kind}'), leaf)
    except (ImportError, AttributeError, ValueError) as error:
        raise UserError(
            f'no type {name!r} is installed; write for example std_msgs/msg/String'
        ) from error
