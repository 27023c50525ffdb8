# SPDX-License-Identifier: Apache-2.0
"""MATLAB logs as tables: vectors, structs of them, or matrices by their columns."""

from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any

from leo_msgs_py.errors import one_line, UserError

from .arrays_log import columns, from_fields
from .log_format import LogFormat, Reader, Table


def read_mat(log: Path, log_format: LogFormat) -> list[Table]:
    """Return the tables of a MATLAB file; of its arrays those as long as the longest."""
    content = _content(log)
    if log_format.fields:
        return from_fields(log, content, log_format)
    found = columns(log, dict(_flat(content)), log_format)
    longest = max(map(len, found.values()), default=0)
    return [{name: values for name, values in found.items() if len(values) == longest}]


def _content(log: Path) -> dict[str, Any]:
    import scipy.io

    try:
        content = scipy.io.loadmat(log, squeeze_me=False, simplify_cells=True)
    except NotImplementedError:
        raise UserError(f'{log} is a MATLAB 7.3 file; save it with -v7') from None
    except Exception as error:  # of a damaged file anything
        raise UserError(f'{log} is not a MATLAB file: {one_line(error)}') from error
    return {name: value for name, value in content.items() if not name.startswith('__')}


def _flat(content: Mapping[str, Any], before: str = '') -> Iterator[tuple[str, Any]]:
    for name, value in content.items():
        if isinstance(value, dict):
            yield from _flat(value, f'{before}{name}.')
        else:
            yield f'{before}{name}', value


MAT = Reader('mat', ('mat',), read_mat)
