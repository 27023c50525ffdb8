# SPDX-License-Identifier: Apache-2.0
"""MATLAB logs as tables: vectors, structs of them, or matrices by their columns."""

from pathlib import Path

from .arrays_log import tables
from .groups_log import read_hdf5
from .log_format import LogFormat, opened, Reader, Table


def read_mat(log: Path, log_format: LogFormat) -> list[Table]:
    import scipy.io

    with opened(log, 'a MATLAB file') as file:
        try:
            content = scipy.io.loadmat(file, squeeze_me=False, simplify_cells=True)
        except NotImplementedError:  # of version 7.3, which is HDF5
            return read_hdf5(file, log_format)
    own = {name: value for name, value in content.items() if not name.startswith('__')}
    return tables(log, own, log_format)


MAT = Reader('mat', ('mat',), read_mat)
