# SPDX-License-Identifier: Apache-2.0
"""Names of columns: each only once, and numbers for those that have none."""

from __future__ import annotations

from collections.abc import Sequence
import re

from leo_msgs_py.errors import UserError
from leo_sim.common.yaml_file import shown

_INDEX = re.compile(r'\[\s*(:|\d+)\s*,\s*(:|\d+)\s*\]')


def each_once(names: Sequence[str], where: str) -> None:
    """Refuse a name that stands above two columns.

    Raises:
        UserError: it says which columns.
    """
    for name in names:
        if name and names.count(name) > 1:
            places = ' and '.join(str(k) for k, n in enumerate(names, start=1) if n == name)
            raise UserError(
                f'{where}: {shown(name)} is the name of columns {places}; rename '
                'them, or name all columns in the column map (header: [...])'
            )


def numbered(width: int) -> list[str]:
    """Return the names of columns that have none: 0, 1, ..."""
    return [str(k) for k in range(width)]


def canonical_index(name: str) -> str:
    """Return the name of a matrix's column as tables have it: `data[:, 2]` of `data[:,2]`."""
    return _INDEX.sub(r'[\1, \2]', name)
