# SPDX-License-Identifier: Apache-2.0
"""NumPy files as tables: arrays by their names, structured ones, or one matrix; no pickles."""

from pathlib import Path

import numpy as np

from .arrays_log import are_columns, tables
from .log_format import LogFormat, opened, Reader, Table


def read_numpy(log: Path, log_format: LogFormat) -> list[Table]:
    kind = 'a NumPy file without objects, which can run code; np.savez(FILE, t=t, q=q) makes one'
    with opened(log, kind) as file:
        content = np.load(file, allow_pickle=False)
        if not isinstance(content, np.ndarray):
            content = {name: array[()] for name, array in content.items()}
        elif content.dtype.names:
            content = {name: content[name] for name in content.dtype.names}
        elif are_columns(content.shape):
            content = content.reshape(len(content), -1).tolist()
    return tables(log, content, log_format)


NUMPY = Reader('numpy', ('npz', 'npy'), read_numpy)
