# SPDX-License-Identifier: Apache-2.0
"""MATLAB logs as tables: vectors, structs of them, or matrices by their columns."""

from pathlib import Path
from typing import Any

from .arrays_log import reader
from .groups_log import hdf5_content
from .log_format import opened


def _content(log: Path) -> Any:
    import scipy.io

    with opened(log, 'a MATLAB file') as file:
        try:
            content = scipy.io.loadmat(file, squeeze_me=False, simplify_cells=True)
        except NotImplementedError:  # of version 7.3, which is HDF5
            return hdf5_content(file)
    return {name: value for name, value in content.items() if not name.startswith('__')}


MAT = reader('mat', ('mat',), _content)
