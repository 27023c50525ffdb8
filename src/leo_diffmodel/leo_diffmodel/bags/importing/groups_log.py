# SPDX-License-Identifier: Apache-2.0
"""HDF5 and zarr as tables: arrays in groups, as `/observations/qpos`, `/data/demo_0/actions`."""

from itertools import pairwise
from pathlib import Path
from typing import Any
import zipfile

from .arrays_log import reader, tables, tree
from .log_format import LogFormat, opened, Reader, Table

HEADS = '.zgroup', 'zarr.json'  # in a folder of zarr 2, of zarr 3


def hdf5_content(log: Path) -> dict[str, Any]:
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


HDF5 = reader('hdf5', ('h5', 'hdf5'), hdf5_content)
ZARR = Reader(
    'zarr', ('zip',), read_zarr, lambda log: any((log / head).is_file() for head in HEADS)
)
