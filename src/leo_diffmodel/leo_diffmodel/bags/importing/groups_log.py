# SPDX-License-Identifier: Apache-2.0
"""HDF5 and zarr as tables: arrays in groups.

ALOHA has `/observations/qpos`, robomimic and Isaac Lab `/data/demo_0/actions`, UMI `/data/action`,
whose rows `/meta/episode_ends` parts.
"""

from itertools import pairwise
from pathlib import Path
import zipfile

from .arrays_log import tables, tree
from .log_format import LogFormat, opened, Reader, Table


def read_hdf5(log: Path, log_format: LogFormat) -> list[Table]:
    import h5py

    with opened(log, 'an HDF5 file') as path, h5py.File(path) as file:
        return tables(log, tree(file, list), log_format)


def read_zarr(log: Path, log_format: LogFormat) -> list[Table]:
    import zarr

    with opened(log, 'a zarr group'):
        root = zipfile.Path(log) if log.is_file() else log
        store = zarr.storage.ZipStore(log, mode='r') if log.is_file() else log
        content = tree(
            zarr.open_group(store, mode='r'),  # which lists none where one has an unknown code
            lambda group: sorted(part.name for part in root.joinpath(group.path).iterdir()),
        )
    ends = content.get('meta', {}).pop('episode_ends', [None])
    parts = [slice(*between) for between in pairwise([0, *ends])]
    (table,) = tables(log, content, log_format)
    return [{name: values[rows] for name, values in table.items()} for rows in parts]


def _is_zarr(path: Path) -> bool:
    return (path / '.zgroup').is_file() or (path / 'zarr.json').is_file()


HDF5 = Reader('hdf5', ('h5', 'hdf5'), read_hdf5)
ZARR = Reader('zarr', ('zip',), read_zarr, _is_zarr)
