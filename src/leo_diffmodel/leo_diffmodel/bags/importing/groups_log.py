# SPDX-License-Identifier: Apache-2.0
"""Files of named arrays as tables: HDF5, zarr, MATLAB, NumPy, of which no pickles."""

from itertools import pairwise
from pathlib import Path
from typing import Any
import zipfile

import numpy as np

from .arrays_log import are_columns, reader, tables, tree
from .log_format import LogFormat, opened, Reader, Table

HEADS = '.zgroup', 'zarr.json'  # in a folder of zarr 2, of zarr 3


def _hdf5_content(log: Path) -> dict[str, Any]:
    import h5py

    with opened(log, 'an HDF5 file') as path, h5py.File(path) as file:
        return tree(file, list)


def read_zarr(log: Path, log_format: LogFormat) -> list[Table]:
    """Return the tables of a folder or .zip; of UMI's, `meta/episode_ends` parts the rows."""
    content = _zarr_content(log)
    ends = content.get('meta', {}).pop('episode_ends', [None])
    parts = [slice(*between) for between in pairwise([0, *ends])]
    whole = tables(log, content, log_format)
    return [{name: c[rows] for name, c in table.items()} for table in whole for rows in parts]


def _zarr_content(log: Path) -> dict[str, Any]:
    import zarr

    with opened(log, 'a zarr group') as path:
        root = zipfile.Path(path) if path.is_file() else path
        store = zarr.storage.ZipStore(path, mode='r') if path.is_file() else path
        return tree(
            zarr.open_group(store, mode='r'),  # which lists none where one has an unknown code
            lambda group: sorted(part.name for part in root.joinpath(group.path).iterdir()),
        )


def _mat_content(log: Path) -> Any:
    import scipy.io

    with opened(log, 'a MATLAB file') as file:
        try:
            content = scipy.io.loadmat(file, squeeze_me=False, simplify_cells=True)
        except NotImplementedError:  # of version 7.3, which is HDF5
            return _hdf5_content(file)
    return {name: value for name, value in content.items() if not name.startswith('__')}


def _numpy_content(log: Path) -> Any:
    kind = 'a NumPy file without objects, which can run code; np.savez(FILE, t=t, q=q) makes one'
    with opened(log, kind) as file:
        content = np.load(file, allow_pickle=False)
        if not isinstance(content, np.ndarray):
            return {name: array[()] for name, array in content.items()}
        if content.dtype.names:
            return {name: content[name] for name in content.dtype.names}
    is_matrix = are_columns(content.shape)
    return content.reshape(len(content), -1).tolist() if is_matrix else content


MAT = reader('mat', ('mat',), _mat_content)
NUMPY = reader('numpy', ('npz', 'npy'), _numpy_content)
HDF5 = reader('hdf5', ('h5', 'hdf5'), _hdf5_content)
ZARR = Reader('zarr', ('zip',), read_zarr, lambda log: any((log / h).is_file() for h in HEADS))
